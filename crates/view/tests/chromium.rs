//! The page in a headless Chromium. Without one these tests are ignored, unless REQUIRE_CHROMIUM is set.

mod features;
mod motions;

use std::collections::HashSet;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use browser::{Browser, Look};
use features::*;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rod::{Assembly, BodyShape, ObstacleShape, Pose, RigidBody, State};
use serde_json::Value;
use tempfile::TempDir;
use view::{Frame, ORIENTATION_PRECISION, Recorder, Run, write_page};

const WIDE: Look = Look { width: 800, height: 600, phone: false, dark: false };
fn page(runs: &[Run]) -> Result<(TempDir, PathBuf)> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("page.html");
    write_page(&path, runs)?;
    Ok((folder, path))
}

fn numbers<const N: usize>(value: &Value) -> Result<[f64; N]> {
    let numbers: Vec<f64> = serde_json::from_value(value.clone())?;
    numbers.try_into().ok().context("other numbers are wanted")
}

/// Checks that the page decodes what was recorded.
fn assert_decoded(browser: &mut Browser, index: usize, run: &Run, frame: usize, state: &State) -> Result<()> {
    for i in [0, state.len() / 2, state.len() - 1] {
        let position = browser.evaluate(&format!("player.position({index}, {frame}, {i})"))?;
        let off = (Vector3::from(numbers(&position)?) - state.positions[i]).amax();
        ensure!(off <= run.position_precision(), "frame {frame}, segment {i}: {off} m off");
        let orientation = browser.evaluate(&format!("player.orientation({index}, {frame}, {i})"))?;
        let [x, y, z, w] = numbers(&orientation)?;
        let decoded = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        let off = decoded.angle_to(&state.orientations[i]);
        ensure!(off <= ORIENTATION_PRECISION, "frame {frame}, segment {i}: {off} rad off");
    }
    Ok(())
}

fn a_page_of_two_runs_plays(browser: &mut Browser) -> Result<()> {
    let motions = [motions::helix(1.0), motions::helix(2.0)];
    let runs = [motions[0].record("calm", 60, 30.0), motions[1].record("wild", 45, 30.0)];
    let (_folder, path) = page(&runs)?;
    browser.look(WIDE)?;
    browser.open(&path)?;
    assert_eq!(browser.evaluate("player.frames")?, 60);
    for (index, (motion, run)) in motions.iter().zip(&runs).enumerate() {
        for frame in [0, 17, 44] {
            assert_decoded(browser, index, run, frame, &motion.state(frame as f64 / 30.0))?;
        }
    }

    // Motion is reduced in these looks: it stands until it is played.
    assert_eq!(browser.evaluate("document.getElementById('play').ariaLabel")?, "Play");
    assert_eq!(browser.evaluate("player.frame")?, 0);
    let start = browser.screenshot(Some("#picture"))?;
    let colours: HashSet<&[u8; 3]> = start.pixels.iter().collect();
    ensure!(colours.len() > 50, "only {} colours: the canvas is blank", colours.len());
    browser.evaluate("player.play()")?;
    browser.wait_for("player.frame > 0")?;
    browser.evaluate("player.pause()")?;
    browser.settle()?;
    assert_eq!(browser.evaluate("Number(scrubber.value) === player.frame")?, true);
    browser.evaluate("player.seek(40)")?;
    browser.settle()?;
    assert_eq!(browser.evaluate("[player.frame, scrubber.value]")?, serde_json::json!([40, "40"]));
    let mut last = browser.screenshot(Some("#picture"))?;
    ensure!(last != start, "another frame looks the same");

    // Every way of looking draws without complaint, and differently from the one before.
    for change in ["colour('curvature')", "colour('tension')", "colour('residual')", "colour('speed')", "beside(true)"]
    {
        browser.evaluate(&format!("player.{change}"))?;
        browser.settle()?;
        let picture = browser.screenshot(Some("#picture"))?;
        ensure!(picture != last, "{change} changes nothing");
        last = picture;
    }
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

fn keys_choices_and_the_chart_do_what_they_say(browser: &mut Browser) -> Result<()> {
    let (_folder, path) = page(&[motions::helix(1.0).record("calm", 60, 30.0)])?;
    browser.look(WIDE)?;
    browser.open(&path)?;
    let mut after = |keys: &str, expression: &str| -> Result<Value> {
        for key in keys.split(' ') {
            let event = format!("dispatchEvent(new KeyboardEvent('keydown', {{key: '{key}', bubbles: true}}))");
            browser.evaluate(&format!("document.body.{event}"))?;
        }
        browser.settle()?;
        browser.evaluate(expression)
    };
    assert_eq!(after("ArrowRight ArrowRight ArrowLeft", "player.frame")?, 1);
    assert_eq!(after("End", "player.frame")?, 59);
    assert_eq!(after("Home", "player.frame")?, 0);
    assert_eq!(after("c", "colour.value")?, "curvature");
    assert_eq!(after("s", "stripe.ariaPressed")?, "false");
    assert_eq!(after("?", "help.open")?, true);
    let middle = "(({left, width, top}) => chart.dispatchEvent(new PointerEvent('pointerdown', \
                  {clientX: left + width / 2, clientY: top + 5, pointerId: 1})))(chart.getBoundingClientRect())";
    // No pointer is down in truth, so that none can be captured.
    browser.evaluate("chart.setPointerCapture = () => {}; help.close()")?;
    browser.evaluate(middle)?;
    let frame = browser.evaluate("player.frame")?.as_i64().context("no frame")?;
    ensure!((25..40).contains(&frame), "the middle of the chart is frame {frame}");
    // Nothing is wider than a phone.
    browser.look(Look { width: 390, height: 844, phone: true, dark: true })?;
    browser.settle()?;
    assert_eq!(browser.evaluate("document.documentElement.scrollWidth")?, 390);
    let outside = "[...document.querySelectorAll('button, select, input, canvas')]\
                   .filter((e) => e.checkVisibility() && e.getBoundingClientRect().right > 390.5).map((e) => e.id)";
    assert_eq!(browser.evaluate(outside)?, serde_json::json!([]));
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

/// Rods of one run are told apart by their colours, and so are runs; the choice is there where there is something to tell.
fn rods_have_colours_of_their_own(browser: &mut Browser) -> Result<()> {
    browser.look(WIDE)?;
    let (tree, helix) = (motions::tree().record("tree", 2, 30.0), motions::helix(1.0).record("helix", 2, 30.0));
    let options = "[...colour.options].slice(0, 2).map((option) => option.text)";
    let mut first_choices = |runs: &[Run]| -> Result<(Value, Value, HashSet<[u8; 3]>)> {
        let (_folder, path) = page(runs)?;
        browser.open(&path)?;
        browser.settle()?;
        let hues = browser.screenshot(Some("#picture"))?.pixels.into_iter();
        // Strong colours alone, coarsely.
        let strong = hues.filter(|p| p.iter().max().zip(p.iter().min()).is_some_and(|(high, low)| high - low > 90));
        let coarse = strong.map(|p| p.map(|c| c / 64)).collect();
        Ok((browser.evaluate("colour.value")?, browser.evaluate(options)?, coarse))
    };
    let (chosen, offered, many) = first_choices(std::slice::from_ref(&tree))?;
    assert_eq!((chosen, offered), ("rod".into(), serde_json::json!(["Rod", "Curvature"])));
    let (chosen, offered, few) = first_choices(std::slice::from_ref(&helix))?;
    assert_eq!((chosen, offered), ("run".into(), serde_json::json!(["One colour", "Curvature"])));
    ensure!(many.len() > few.len() + 5, "{} colours of rods, {} of one", many.len(), few.len());
    let (chosen, offered, _) = first_choices(&[helix, tree])?;
    assert_eq!((chosen, offered), ("run".into(), serde_json::json!(["Run", "Rod"])));
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

fn fingers_turn_move_and_enlarge(browser: &mut Browser) -> Result<()> {
    let (_folder, path) = page(&[motions::helix(1.0).record("calm", 5, 30.0)])?;
    browser.look(Look { width: 390, height: 844, phone: true, dark: false })?;
    browser.open(&path)?;
    let mut after = |fingers: &[[[f64; 2]; 2]]| {
        browser.drag(fingers)?;
        browser.settle()?;
        let picture = browser.screenshot(Some("#picture"))?;
        let of_rod = |[r, _, b]: &&[u8; 3]| *b > r.saturating_add(40);
        let area = picture.pixels.iter().filter(of_rod).count() as f64;
        anyhow::Ok((picture, area))
    };
    let (start, area) = after(&[[[100.0, 300.0]; 2]])?;
    ensure!(area > 500.0, "only {area} pixels of a rod");
    let (turned, _) = after(&[[[100.0, 300.0], [300.0, 250.0]]])?;
    ensure!(turned != start, "a finger turns nothing");
    let (back, _) = after(&[[[300.0, 250.0], [100.0, 300.0]]])?;
    ensure!(back == start, "a finger that goes back leaves something turned");
    // Apart, as far again: twice as near.
    let (_, near) = after(&[[[145.0, 300.0], [95.0, 300.0]], [[245.0, 300.0], [295.0, 300.0]]])?;
    ensure!(near > 2.0 * area, "pinched to twice the size, the rod covers {near} pixels instead of {area}");
    let (moved, _) = after(&[[[100.0, 300.0], [160.0, 360.0]], [[200.0, 300.0], [260.0, 360.0]]])?;
    ensure!(moved != start, "two fingers move nothing");
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

fn a_tree_of_a_thousand_segments_opens_and_is_what_was_recorded(browser: &mut Browser) -> Result<()> {
    let tree = motions::tree();
    let run = tree.record("tree", 300, 60.0);
    let (_folder, path) = page(std::slice::from_ref(&run))?;
    browser.look(WIDE)?;
    let took = browser.open(&path)?;
    println!("{} bytes, ready after {took:.2?}", std::fs::metadata(&path)?.len());
    for frame in [0, 299] {
        assert_decoded(browser, 0, &run, frame, &tree.state(frame as f64 / 60.0))?;
    }
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

fn a_lost_graphics_processor_comes_back(browser: &mut Browser) -> Result<()> {
    let (_folder, path) = page(&[motions::helix(1.0).record("calm", 5, 30.0)])?;
    browser.look(WIDE)?;
    browser.open(&path)?;
    browser.settle()?;
    let before = browser.screenshot(Some("#picture"))?;
    let lose = "new Promise((done) => { const gl = picture.getContext('webgl2'); \
                const loss = gl.getExtension('WEBGL_lose_context'); \
                picture.addEventListener('webglcontextlost', () => setTimeout(() => loss.restoreContext(), 50)); \
                picture.addEventListener('webglcontextrestored', () => setTimeout(done, 50)); loss.loseContext(); })";
    browser.evaluate(lose)?;
    browser.settle()?;
    ensure!(browser.screenshot(Some("#picture"))? == before, "it is not drawn as before");
    Ok(())
}

fn what_a_browser_lacks_is_said(browser: &mut Browser) -> Result<()> {
    let (_folder, path) = page(&[motions::helix(1.0).record("calm", 5, 30.0)])?;
    browser.look(WIDE)?;
    browser.before_each_page("HTMLCanvasElement.prototype.getContext = () => null")?;
    let error = browser.open(&path).err().context("it opens without WebGL")?.to_string();
    ensure!(error.contains("WebGL 2"), "{error}");
    browser.before_each_page("delete window.DecompressionStream")?;
    let error = browser.open(&path).err().context("it opens without DecompressionStream")?.to_string();
    ensure!(error.contains("DecompressionStream"), "{error}");
    Ok(())
}

fn odd_names_and_single_frames_are_shown(browser: &mut Browser) -> Result<()> {
    let motion = motions::helix(1.0);
    let name = "</script><script>document.title = 'broken'</script> & \u{2028} ' \"";
    let state = motion.state(0.0);
    let mut recorder = Recorder::new(name, 0.01, &motion.model);
    let nothing = f64::NAN;
    recorder.push(&Frame {
        time: 1e6,
        state: &state,
        forces: &[],
        energy: nothing,
        length_ratio: nothing,
        iterations: nothing,
    });
    let (_folder, path) = page(&[recorder.finish()])?;
    browser.look(WIDE)?;
    browser.open(&path)?;
    assert_eq!(browser.evaluate("document.querySelector('#legend label span:last-child').textContent")?, name);
    browser.evaluate("player.play(); player.colour('residual')")?;
    browser.settle()?;
    assert_eq!(browser.evaluate("[player.frame, player.frames]")?, serde_json::json!([0, 1]));
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

/// A rigid body is drawn as what it is: of a ball one sees a disc, of a box its faces, of a hidden body
/// next to nothing.
fn rigid_bodies_are_drawn_as_what_they_are(browser: &mut Browser) -> Result<()> {
    browser.look(WIDE)?;
    let mut share = |body: RigidBody| -> Result<(f64, usize)> {
        let mut assembly = Assembly::new(Vector3::zeros());
        assembly.body(body, Pose { position: Vector3::z() * 2.0, orientation: UnitQuaternion::identity() });
        let (model, state) = assembly.finish();
        let mut recorder = Recorder::new("body", 0.01, &model);
        let nothing = f64::NAN;
        let values = Frame {
            time: 0.0,
            state: &state,
            forces: &[],
            energy: nothing,
            length_ratio: nothing,
            iterations: nothing,
        };
        recorder.push(&values);
        let (_folder, path) = page(&[recorder.finish()])?;
        browser.open(&path)?;
        browser.settle()?;
        let picture = browser.screenshot(Some("#picture"))?;
        let seen: Vec<[usize; 2]> = (0..picture.pixels.len())
            .filter(|&i| picture.pixels[i][2] > picture.pixels[i][0].saturating_add(40))
            .map(|i| [i % picture.width, i / picture.width])
            .collect();
        // Rows and columns that hold more of it than of the legend's line.
        let extent = |axis: usize| {
            let mut counts = vec![0; picture.width.max(picture.pixels.len() / picture.width)];
            seen.iter().for_each(|place| counts[place[axis]] += 1);
            counts.into_iter().filter(|&count| count > 24).count().max(1)
        };
        Ok((seen.len() as f64 / (extent(0) * extent(1)) as f64, seen.len()))
    };
    let (ball, pixels) = share(RigidBody::new(BodyShape::Sphere { radius: 0.5 }, 1.0))?;
    ensure!(pixels > 5000 && (ball - std::f64::consts::FRAC_PI_4).abs() < 0.03, "a ball: {pixels} pixels, {ball}");
    let (_, block) = share(RigidBody::new(BodyShape::Box { sides: Vector3::repeat(0.6) }, 1.0))?;
    let (_, unseen) = share(RigidBody::hidden(1.0, Vector3::repeat(0.1)))?;
    ensure!(block > 5000 && unseen < 500, "a box: {block} pixels; a hidden body: {unseen}");
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

fn obstacles_go_where_they_are_driven(browser: &mut Browser) -> Result<()> {
    let motion = motions::driven();
    let (_folder, path) = page(&[motion.record("driven", 31, 10.0)])?;
    browser.look(WIDE)?;
    browser.open(&path)?;
    for (index, obstacle) in motion.model.contacts.obstacles.iter().enumerate() {
        for frame in [0, 7, 30] {
            let drawn = browser.evaluate(&format!("player.obstacle(0, {frame}, {index})"))?;
            let places = match obstacle.shape_at(f64::from(frame) / 10.0) {
                ObstacleShape::HalfSpace { point, normal } => [("point", point), ("normal", *normal)],
                ObstacleShape::Sphere { centre, .. } => [("centre", centre); 2],
                ObstacleShape::Capsule { start, end, .. } => [("start", start), ("end", end)],
                shape => [("centre", shape.pivot()); 2],
            };
            for (key, place) in places {
                let off = (Vector3::from(numbers(&drawn[key])?) - place).amax();
                ensure!(off < 1e-6, "frame {frame}, obstacle {index}, {key}: {off} m off");
            }
        }
    }
    // The rods alone do not change the picture so: where they stay, obstacles are still seen to move.
    let still = motion.record_at("still", 2, 10.0, |_| 0.0);
    let (_folder, path) = page(&[still])?;
    browser.open(&path)?;
    browser.settle()?;
    let before = browser.screenshot(Some("#picture"))?;
    browser.evaluate("player.seek(1)")?;
    browser.settle()?;
    ensure!(browser.screenshot(Some("#picture"))? != before, "the obstacles stand still");
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

browser::tests![
    a_page_of_two_runs_plays,
    obstacles_go_where_they_are_driven,
    keys_choices_and_the_chart_do_what_they_say,
    rods_have_colours_of_their_own,
    fingers_turn_move_and_enlarge,
    a_tree_of_a_thousand_segments_opens_and_is_what_was_recorded,
    a_lost_graphics_processor_comes_back,
    what_a_browser_lacks_is_said,
    odd_names_and_single_frames_are_shown,
    rigid_bodies_are_drawn_as_what_they_are,
    obstacles_fade_and_hide,
    the_camera_frames_what_moves,
    views_from_the_top_the_front_and_the_side,
    probes_and_reactions_are_curves,
    a_click_says_what_is_there,
    modes_have_labels_instead_of_times,
    grips_loads_and_contacts_are_marked,
    pictures_and_videos_are_saved,
    a_phone_shows_help_and_ticks_that_can_be_read,
    what_a_run_has_not_is_not_offered,
];
