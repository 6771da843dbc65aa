//! What one does on the page beside playing: looks, views.

use std::collections::HashMap;

use anyhow::{Context, Result, ensure};
use browser::{Browser, Look, Picture};
use nalgebra::Vector3;
use rod::{Load, Obstacle, ObstacleShape, Surface};
use serde_json::{Value, json};
use view::{Curve, Frame, Line, Pressing, Recorder};

use crate::motions::{self, Motion};
use crate::{WIDE, numbers, page};

pub(crate) const PHONE: Look = Look { width: 390, height: 844, phone: true, dark: true };

/// Presses keys on the page, and waits until it is drawn.
fn press(browser: &mut Browser, keys: &str) -> Result<()> {
    for key in keys.split(' ') {
        let event = format!("new KeyboardEvent('keydown', {{key: '{key}', bubbles: true}})");
        browser.evaluate(&format!("document.body.dispatchEvent({event})"))?;
    }
    browser.settle()
}

/// Places of the picture's pixels that are as blue as the only run's rods, as shares of its width and height.
fn blue(picture: &Picture) -> Vec<[f64; 2]> {
    let (width, height) = (picture.width, picture.height());
    let share = |i: usize| [(i % width) as f64 / width as f64, (i / width) as f64 / height as f64];
    let is_blue = |&i: &usize| picture.pixels[i][2] > picture.pixels[i][0].saturating_add(60);
    // Not the line in the legend.
    (0..picture.pixels.len()).filter(is_blue).map(share).filter(|[x, y]| *x > 0.1 || *y > 0.1).collect()
}

fn shot(browser: &mut Browser) -> Result<Picture> {
    browser.settle()?;
    browser.screenshot(Some("#picture"))
}

pub(crate) fn obstacles_fade_and_hide(browser: &mut Browser) -> Result<()> {
    browser.look(WIDE)?;
    let (_folder, path) = page(&[motions::catheter().record("catheter", 5, 10.0)])?;
    browser.open(&path)?;
    let mut seen = HashMap::new();
    for _ in 0..3 {
        let picture = shot(browser)?;
        let how = browser.evaluate("obstacles.value")?;
        seen.insert(how.as_str().unwrap_or_default().to_owned(), picture);
        press(browser, "o")?;
    }
    assert_eq!(browser.evaluate("obstacles.value")?, "faded", "what hides a rod is faded at the start");
    let [solid, faded, hidden] = ["solid", "faded", "hidden"].map(|how| &seen[how]);
    let areas = [solid, faded, hidden].map(|picture| blue(picture).len());
    // The ends of the catheter stick out of the vessel.
    ensure!(areas[0] > 20 && 3 * areas[0] < areas[1], "{areas:?} pixels of the rod");
    ensure!(areas[1] as f64 > 0.8 * areas[2] as f64, "{areas:?} pixels of the rod");
    // Glass is darker than the sky beside the rod, and lighter than the vessel; the rod shows through it in its own colour.
    let differing = |a: &Picture, b: &Picture, i: usize| a.pixels[i][0].abs_diff(b.pixels[i][0]) > 6;
    let count = |a: &Picture, b: &Picture| (0..a.pixels.len()).filter(|&i| differing(a, b, i)).count();
    let (glass, vessel) = (count(faded, hidden), count(solid, hidden));
    ensure!(glass > vessel / 2, "glass of {glass} pixels of a vessel of {vessel}");

    // Without obstacles there is nothing to choose, and help does not speak of it.
    let mut alone = motions::catheter();
    alone.model.contacts.obstacles.clear();
    let (_folder, path) = page(&[alone.record("alone", 5, 10.0)])?;
    browser.open(&path)?;
    browser.evaluate("help.showModal()")?;
    let shown = browser
        .evaluate("[...document.querySelectorAll('.of-obstacles')].filter((e) => e.checkVisibility()).length")?;
    assert_eq!(shown, 0);
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

/// Least and most of the places of a run's segments on the page, as shares of the picture, over all frames.
fn extent(browser: &mut Browser, motion: &Motion, frames: usize, rate: f64) -> Result<[[f64; 2]; 2]> {
    let [left, top, width, height] =
        numbers(&browser.evaluate(
            "(({left, top, width, height}) => [left, top, width, height])(picture.getBoundingClientRect())",
        )?)?;
    let states = (0..frames).map(|frame| motion.state(frame as f64 / rate));
    let places: Vec<[f64; 3]> = states.flat_map(|state| state.positions).map(Into::into).collect();
    let shown = browser.evaluate(&format!("{}.map(player.project)", json!(places)))?;
    let shown: Vec<[f64; 2]> = serde_json::from_value(shown)?;
    let bounds = |values: Vec<f64>| {
        [values.iter().copied().fold(f64::INFINITY, f64::min), values.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
    };
    Ok([
        bounds(shown.iter().map(|[x, _]| (x - left) / width).collect()),
        bounds(shown.iter().map(|[_, y]| (y - top) / height).collect()),
    ])
}

pub(crate) fn the_camera_frames_what_moves(browser: &mut Browser) -> Result<()> {
    const FRAMES: usize = 40;
    browser.look(WIDE)?;
    let ball = |place: Vector3<f64>, radius| {
        Obstacle::new(ObstacleShape::Sphere { centre: place, radius }, Surface::default())
    };
    let mut scenes = Vec::new();
    let mut add = |what, obstacles: Vec<Obstacle>| {
        let mut motion = motions::helix(1.0);
        motion.model.contacts.obstacles = obstacles;
        scenes.push((what, motion));
    };
    add("alone", Vec::new());
    add("beside a hill", vec![ball(Vector3::z() * -30.0, 29.0)]);
    add("far from a ball", vec![ball(Vector3::x() * 9.0, 0.1)]);
    for (what, motion) in &scenes {
        let (_folder, path) = page(&[motion.record("run", FRAMES, 10.0)])?;
        browser.open(&path)?;
        let [x, y] = extent(browser, motion, FRAMES, 10.0)?;
        ensure!([x, y].iter().all(|[low, high]| *low > 0.0 && *high < 1.0), "{what}: {x:?}, {y:?} is cut off");
        ensure!([x, y].iter().any(|[low, high]| high - low > 0.75), "{what}: {x:?}, {y:?} is small");
    }
    // What moves is framed, however far it goes; so is what stands near by.
    let mut near = motions::helix(1.0);
    near.model.contacts.obstacles = vec![ball(Vector3::new(0.0, 0.0, 0.0), 0.1)];
    let mut far = motions::helix(1.0);
    far.model.contacts.obstacles = vec![motions::moving(ball(Vector3::x(), 0.1), Vector3::x() * 2.0)];
    for (motion, places) in [(near, [[0.0, 0.0, -0.1], [0.0; 3]]), (far, [[1.0, 0.0, 0.0], [8.8, 0.0, 0.0]])] {
        let (_folder, path) = page(&[motion.record("run", FRAMES, 10.0)])?;
        browser.open(&path)?;
        let inside = "([x, y]) => picture === document.elementsFromPoint(x, y).find((e) => e === picture)";
        let seen = browser.evaluate(&format!("{}.map(player.project).map({inside})", json!(places)))?;
        assert_eq!(seen, json!([true, true]));
    }
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

pub(crate) fn views_from_the_top_the_front_and_the_side(browser: &mut Browser) -> Result<()> {
    browser.look(WIDE)?;
    let (_folder, path) = page(&[motions::helix(1.0).record("calm", 5, 10.0)])?;
    browser.open(&path)?;
    let start = shot(browser)?;
    let axes = "(() => { const at = player.project; const o = at([0, 0, 0.3]);\
                return [[0.1, 0, 0.3], [0, 0.1, 0.3], [0, 0, 0.4]].map(at).map(([x, y]) => [x - o[0], o[1] - y]); })()";
    // Where x, y and z point on the page: right and up.
    for (name, key, right, up) in [("top", "t", 0, 1), ("front", "f", 0, 2), ("side", "d", 1, 2)] {
        for way in [key, "r", "button"] {
            match way {
                "button" => drop(browser.evaluate(&format!("document.getElementById('{name}').click()"))?),
                key => press(browser, key)?,
            }
            let shown: Value = browser.evaluate(axes)?;
            let shown: Vec<[f64; 2]> = serde_json::from_value(shown)?;
            let straight = shown[right][0] > 20.0
                && shown[right][1].abs() < 1.0
                && shown[up][1] > 20.0
                && shown[up][0].abs() < 1.0;
            assert_eq!(straight, way != "r", "{name}, {way}: {shown:?}");
        }
        browser.evaluate("document.getElementById('reset').click()")?;
        ensure!(shot(browser)? == start, "from the view {name} one does not come back");
    }
    browser.look(PHONE)?;
    browser.settle()?;
    let outside =
        "[...document.querySelectorAll('#views button')].filter((e) => e.getBoundingClientRect().right > 390).length";
    assert_eq!(browser.evaluate(outside)?, 0);
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

/// Where the page's elements of a selector stand, or what they say, in their order.
fn texts(browser: &mut Browser, selector: &str) -> Result<Vec<String>> {
    let all = format!("[...document.querySelectorAll('{selector}')].map((e) => e.label ?? e.textContent)");
    Ok(serde_json::from_value(browser.evaluate(&all)?)?)
}

fn choose(browser: &mut Browser, id: &str, value: &str) -> Result<()> {
    browser.evaluate(&format!("{id}.value = '{value}'; {id}.dispatchEvent(new Event('change')); 0"))?;
    browser.settle()
}

pub(crate) fn probes_and_reactions_are_curves(browser: &mut Browser) -> Result<()> {
    const FRAMES: usize = 41;
    browser.look(WIDE)?;
    let mut recorder = motions::catheter().recorder("catheter", FRAMES, 10.0, |time| time);
    let ramp =
        |slope: f64| -> Vec<f64> { (0..FRAMES).map(|k| if k == 0 { f64::NAN } else { slope * k as f64 }).collect() };
    let curve = |group: &str, label: &str, unit: &str, lines: Vec<Line>| Curve {
        group: group.to_owned(),
        label: label.to_owned(),
        unit: unit.to_owned(),
        lines,
    };
    recorder.add_curve(curve(
        "Probes",
        "tension",
        "N",
        vec![Line::new("hand", &ramp(1.0)), Line::new("tip", &ramp(-1.0))],
    ));
    let axes = [("x", 3.0), ("y", 4.0), ("z", 0.0)].map(|(name, slope)| Line::new(name, &ramp(slope)));
    recorder.add_curve(curve("Reactions", "catheter, start: force", "N", axes.into()));
    let run = recorder.finish();
    let (_folder, path) = page(std::slice::from_ref(&run))?;
    browser.open(&path)?;
    browser.settle()?;
    assert_eq!(texts(browser, "#curve optgroup")?, ["Probes", "Reactions"]);
    assert_eq!(texts(browser, "#curve optgroup option")?, ["tension [N]", "catheter, start: force [N]"]);
    assert_eq!(
        browser.evaluate("document.getElementById('curve-legend').checkVisibility()")?,
        false,
        "energy needs none"
    );
    let mut drawn = vec![browser.evaluate("chart.toDataURL()")?];
    for (key, legend) in [
        ("Probes/tension", &["tension [N]", "hand", "tip"][..]),
        ("Reactions/catheter, start: force", &["catheter, start: force [N]", "x", "y", "z", "magnitude"]),
    ] {
        choose(browser, "curve", key)?;
        assert_eq!(texts(browser, "#curve-legend > *")?, legend);
        let chart = browser.evaluate("chart.toDataURL()")?;
        ensure!(!drawn.contains(&chart), "{key} draws what was there before");
        drawn.push(chart);
    }
    // Lines have the colours of the legend: the one that falls is below the one that rises, at the end.
    choose(browser, "curve", "Probes/tension")?;
    let height = |colour: &str| {
        format!(
            "(() => {{ const wanted = getComputedStyle(document.documentElement).getPropertyValue('--{colour}').trim();\
             const pen = chart.getContext('2d'); const x = chart.width - 15;\
             const column = pen.getImageData(x, 0, 1, chart.height).data;\
             const hit = (y) => [1, 3, 5].every((at, k) => Math.abs(parseInt(wanted.slice(at, at + 2), 16) - column[4 * y + k]) < 60 && column[4 * y + 3] > 100);\
             return Array.from({{length: chart.height}}, (_, y) => y).find(hit) ?? null; }})()"
        )
    };
    let rises = browser.evaluate(&height("s0"))?.as_f64().context("no line of the first colour")?;
    let falls = browser.evaluate(&height("s1"))?.as_f64().context("no line of the second colour")?;
    ensure!(rises + 30.0 < falls, "{rises} and {falls}");
    // A click shows its time.
    let middle = "(({left, width, top}) => { chart.setPointerCapture = () => {}; chart.dispatchEvent(new PointerEvent('pointerdown', \
                  {clientX: left + width / 2, clientY: top + 5, pointerId: 1})); return player.frame; })(chart.getBoundingClientRect())";
    let frame = browser.evaluate(middle)?.as_i64().context("no frame")?;
    ensure!((17..26).contains(&frame), "the middle of the chart is frame {frame}");
    // Of several runs, colours tell runs apart and dashes lines.
    let (_folder, path) = page(&[run.clone(), run])?;
    browser.open(&path)?;
    choose(browser, "curve", "Reactions/catheter, start: force")?;
    assert_eq!(texts(browser, "#curve-legend > *")?.len(), 5);
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

/// What the card says: its name, then what and how much, in turns.
fn card(browser: &mut Browser) -> Result<Vec<String>> {
    browser.settle()?;
    if browser.evaluate("card.checkVisibility()")? == false {
        return Ok(Vec::new());
    }
    texts(browser, "#card-name, #card-values > *")
}

fn click(browser: &mut Browser, place: &str) -> Result<()> {
    let click = format!(
        "(([x, y]) => {{ picture.setPointerCapture = () => {{}}; for (const what of ['pointerdown', 'pointerup'])\
         picture.dispatchEvent(new PointerEvent(what, {{clientX: x, clientY: y, pointerId: 1, button: 0}})); }})({place}); 0"
    );
    browser.evaluate(&click).map(drop)
}

/// The number in what stands beside a word on the card.
fn value(card: &[String], what: &str) -> Result<f64> {
    let at = card.iter().position(|text| text == what).with_context(|| format!("no {what} in {card:?}"))?;
    let text = card[at + 1].split(' ').next().unwrap_or_default().replace('\u{2212}', "-");
    text.trim_end_matches(',').parse().with_context(|| format!("{what}: {text}"))
}

pub(crate) fn a_click_says_what_is_there(browser: &mut Browser) -> Result<()> {
    browser.look(WIDE)?;
    let mut recorder = motions::catheter().recorder("run", 5, 10.0, |time| time);
    recorder.name(vec!["catheter".to_owned()], vec!["vessel".to_owned()]);
    let (_folder, path) = page(&[recorder.finish()])?;
    browser.open(&path)?;
    click(browser, "player.project(player.position(0, 0, 20))")?;
    let said = card(browser)?;
    assert_eq!(said[..3], ["catheter", "Segment", "20 of 0 to 39"]);
    assert_eq!(said[3], "Position");
    ensure!(said[4].ends_with("0.205 m") || said[4].contains("0.205"), "{said:?}");
    for what in ["Curvature", "Speed", "Twist"] {
        ensure!(said.contains(&what.to_owned()), "no {what}: {said:?}");
    }
    // In the first frame nothing is known of forces.
    ensure!(!said.contains(&"Tension".to_owned()), "{said:?}");
    browser.evaluate("player.seek(3)")?;
    ensure!(card(browser)?.contains(&"Tension".to_owned()), "the card does not go with the frame");
    // Through glass one means the rod, else what is in front.
    browser.evaluate("player.obstacles('solid')")?;
    click(browser, "player.project(player.position(0, 0, 20))")?;
    assert_eq!(card(browser)?[..3], ["vessel", "Obstacle", "Surface"]);
    press(browser, "Escape")?;
    assert_eq!(card(browser)?, [""; 0]);
    // Nothing is what the sky has; a way is no click.
    click(browser, "player.project(player.position(0, 0, 39))")?;
    ensure!(!card(browser)?.is_empty(), "the end of the rod sticks out of the vessel");
    click(browser, "[5, 300]")?;
    assert_eq!(card(browser)?, [""; 0]);

    // By a finger, beside a thin rod, on a coil that is twisted.
    browser.look(PHONE)?;
    let (_folder, path) = page(&[motions::helix(1.0).record("calm", 5, 10.0)])?;
    browser.open(&path)?;
    let place: [f64; 2] = numbers(&browser.evaluate("player.project(player.position(0, 0, 40))")?)?;
    let finger = [place[0] + 5.0, place[1]];
    browser.drag(&[[finger, finger]])?;
    let said = card(browser)?;
    assert_eq!(said.first().map(String::as_str), Some("rod 0"));
    let twist = value(&said, "Twist")?;
    ensure!((twist - 0.07 / 0.045).abs() < 0.2, "{twist} rad/m");
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

pub(crate) fn modes_have_labels_instead_of_times(browser: &mut Browser) -> Result<()> {
    browser.look(WIDE)?;
    let motion = motions::catheter();
    let mut recorder = Recorder::new("catheter, modes", 0.1, &motion.model);
    let labels = ["at rest", "mode 0: 0.4359 Hz", "mode 1: 1.26 Hz"];
    for frame in 0..21 {
        if let Some(chapter) = [0, 1, 11].iter().position(|&first| first == frame) {
            recorder.begin_chapter(labels[chapter]);
        }
        let time = frame as f64 / 10.0;
        let (state, nothing) = (motion.state(time), f64::NAN);
        recorder.push(&Frame {
            time,
            state: &state,
            forces: &[],
            energy: nothing,
            length_ratio: nothing,
            iterations: nothing,
        });
    }
    let (_folder, path) = page(&[recorder.finish()])?;
    browser.open(&path)?;
    browser.settle()?;
    assert_eq!(texts(browser, "#chapter option")?, [&["All"][..], &labels].concat());
    assert_eq!(browser.evaluate("clock.textContent")?, labels[1], "the first mode is shown first");
    assert_eq!(browser.evaluate("[chart.checkVisibility(), player.frame]")?, json!([false, 1]));
    choose(browser, "chapter", "2")?;
    assert_eq!(browser.evaluate("[clock.textContent, player.frame]")?, json!([labels[2], 11]));
    // It swings again and again, and no other one does.
    let frames = "new Promise((done) => { const seen = new Set(); player.play(); const look = () => { seen.add(player.frame);\
                  if (seen.has(20) && player.frame < 15) { player.pause(); done([...seen]); } else requestAnimationFrame(look); }; look(); })";
    let seen: Vec<usize> = serde_json::from_value(browser.evaluate(frames)?)?;
    ensure!(seen.iter().all(|frame| (11..=20).contains(frame)), "{seen:?}");
    press(browser, "PageUp")?;
    assert_eq!(browser.evaluate("clock.textContent")?, labels[1]);
    choose(browser, "chapter", "all")?;
    assert_eq!(browser.evaluate("player.frame")?, 0);
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

pub(crate) fn grips_loads_and_contacts_are_marked(browser: &mut Browser) -> Result<()> {
    browser.look(WIDE)?;
    let mut motion = motions::catheter();
    motion.model.contacts.obstacles.clear();
    motion.model.loads.push(Load {
        segment: 39,
        offset: 0.005,
        force: Vector3::x() * 2.0,
        torque: Vector3::zeros(),
        follows: false,
    });
    let mut recorder = motion.recorder("run", 1, 10.0, |time| time);
    let state = motion.state(0.0);
    let pressing = |segment: usize, force: f64| Pressing {
        segment,
        place: state.positions[segment] + Vector3::x() * 0.004,
        force: Vector3::x() * -force,
    };
    recorder.push_contacts(&state, [pressing(10, 1.0), pressing(25, 2.0)].into_iter());
    let (_folder, path) = page(&[recorder.finish()])?;
    browser.open(&path)?;
    let marks = browser.evaluate("player.marks(0, 0)")?;
    let marks: Vec<Value> = serde_json::from_value(marks)?;
    assert_eq!(marks.len(), 4, "{marks:?}");
    for (k, (place, force)) in [
        (state.positions[39] + Vector3::z() * 0.005, Vector3::x() * 2.0),
        (pressing(10, 1.0).place, pressing(10, 1.0).force),
        (pressing(25, 2.0).place, pressing(25, 2.0).force),
    ]
    .into_iter()
    .enumerate()
    {
        let [own_place, own_force] = [&marks[k][0], &marks[k][1]].map(numbers).map(|own| own.map(Vector3::from));
        let off = ((own_place? - place).amax(), (own_force? - force).amax());
        ensure!(off.0 < 1e-4 && off.1 < 0.01, "mark {k}: {off:?} off");
    }
    // Without the toggle nothing is drawn of them; with it, as long as the legend says.
    let strong = |picture: &Picture, wanted: [u8; 3]| -> Vec<f64> {
        let is_close = |p: &[u8; 3]| p.iter().zip(wanted).all(|(a, b)| a.abs_diff(b) < 70);
        let is_grey = |p: &[u8; 3]| p.iter().max().zip(p.iter().min()).is_some_and(|(high, low)| high - low < 60);
        // Not the signs of the legend at the bottom.
        let above = picture.width * picture.height() * 85 / 100;
        let own = picture.pixels[..above].iter().enumerate().filter(|(_, p)| is_close(p) && !is_grey(p));
        own.map(|(i, _)| (i % picture.width) as f64).collect()
    };
    let (amber, magenta) = ([0xb8, 0x79, 0x00], [0xc2, 0x18, 0x7c]);
    let plain = shot(browser)?;
    assert_eq!([amber, magenta].map(|colour| strong(&plain, colour).len()), [0, 0]);
    press(browser, "f g")?;
    let marked = shot(browser)?;
    let contacts = strong(&marked, magenta).len();
    ensure!(contacts > 10, "{contacts} pixels of contacts");
    let said = texts(browser, "#note > *")?;
    assert_eq!(said[1..4], ["Grips", "Loads", "Contact forces"]);
    let scale = said.last().context("no scale")?;
    let words: Vec<&str> = scale.split(' ').collect();
    let [newtons, metres] = [words[0], words[6]].map(str::parse::<f64>);
    let long = 2.0 / newtons? * metres?;
    let ends = format!("[[0, 0, 0.4], [{long}, 0, 0.4]].map(player.project).map(([x]) => x)");
    let ends: [f64; 2] = numbers(&browser.evaluate(&ends)?)?;
    let drawn = strong(&marked, amber);
    let bounds = drawn.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &x| (low.min(x), high.max(x)));
    let off = (bounds.1 - bounds.0) - (ends[1] - ends[0]);
    ensure!(off.abs() < 8.0, "the load is {bounds:?} long, {ends:?} by the legend \"{scale}\"");
    browser.evaluate("document.getElementById('marks').click()")?;
    press(browser, "r")?;
    ensure!(shot(browser)? == plain, "the toggle leaves something");
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

pub(crate) fn pictures_and_videos_are_saved(browser: &mut Browser) -> Result<()> {
    browser.look(WIDE)?;
    let (_folder, path) = page(&[motions::helix(1.0).record("calm, slow", 12, 10.0)])?;
    browser.open(&path)?;
    // Files go to downloads; what they are is caught on the way.
    browser.evaluate(
        "window.saved = []; URL.createObjectURL = (blob) => { saved.push(blob); return '#'; };\
         HTMLAnchorElement.prototype.click = function () { saved.at(-1).as = this.download; }; player.seek(7); player.colour('speed'); 0",
    )?;
    browser.settle()?;
    browser.evaluate("document.getElementById('save-picture').click()")?;
    browser.wait_for("saved.length === 1")?;
    assert_eq!(browser.evaluate("[saved[0].type, saved[0].as]")?, json!(["image/png", "calm-slow-7.png"]));
    let looked_at = "createImageBitmap(saved[0]).then((image) => { const canvas = new OffscreenCanvas(image.width, image.height);\
                     const pen = canvas.getContext('2d'); pen.drawImage(image, 0, 0); const { data } = pen.getImageData(0, 0, image.width, image.height);\
                     const words = new Set(new Uint32Array(data.buffer)); return [image.width === picture.width, image.height === picture.height, words.size]; })";
    let [wide, high, colours] = serde_json::from_value::<[Value; 3]>(browser.evaluate(looked_at)?)?;
    assert_eq!([wide, high], [json!(true), json!(true)]);
    ensure!(colours.as_u64() > Some(300), "{colours} colours: the picture is blank");
    browser.evaluate(
        "speed.value = 2; speed.dispatchEvent(new Event('change')); document.getElementById('save-video').click()",
    )?;
    browser.wait_for("saved.length === 2")?;
    let begins = "saved[1].arrayBuffer().then((data) => [saved[1].type.slice(0, 10), saved[1].as, data.byteLength > 3000, [...new Uint8Array(data, 0, 4)]])";
    // The first bytes of a WebM file.
    assert_eq!(browser.evaluate(begins)?, json!(["video/webm", "calm-slow.webm", true, [0x1a, 0x45, 0xdf, 0xa3]]));
    assert_eq!(browser.evaluate("[player.frame, saved.length]")?, json!([11, 2]), "it ends with the motion");
    browser.evaluate("delete window.MediaRecorder; document.getElementById('save-video').click()")?;
    browser.settle()?;
    let said = browser.evaluate("said.checkVisibility() ? said.textContent : ''")?;
    ensure!(said.as_str().is_some_and(|text| text.contains("cannot record videos")), "{said}");
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

pub(crate) fn a_phone_shows_help_and_ticks_that_can_be_read(browser: &mut Browser) -> Result<()> {
    browser.look(PHONE)?;
    let mut recorder = motions::catheter().recorder("a name, and what it was solved with", 5, 10.0, |time| time);
    recorder.name(vec!["catheter".to_owned()], vec!["vessel".to_owned()]);
    let (_folder, path) = page(&[recorder.finish()])?;
    browser.open(&path)?;
    browser.evaluate("document.getElementById('help-open').click()")?;
    browser.settle()?;
    assert_eq!(browser.evaluate("help.scrollTop")?, 0, "help opens at its beginning");
    let narrow =
        "[...document.querySelectorAll('#help dd')].filter((e) => e.checkVisibility() && e.clientWidth < 250).length";
    assert_eq!(browser.evaluate(narrow)?, 0);
    let close = "(({bottom}) => bottom > 0 && bottom < innerHeight)(document.querySelector('#help button').getBoundingClientRect())";
    assert_eq!(browser.evaluate(close)?, true, "it can be closed without scrolling");
    browser.evaluate("help.close()")?;
    // Ticks of the colour bar, also where there is little room.
    for width in ["", "9rem", "5rem"] {
        browser.evaluate(&format!("bar.style.width = '{width}'; player.colour('tension')"))?;
        browser.settle()?;
        let overlap = "(() => { const all = [...document.querySelectorAll('#bar-ticks span')].filter((e) => e.checkVisibility({visibilityProperty: true}));\
                       const at = all.map((e) => e.getBoundingClientRect()).sort((a, b) => a.left - b.left);\
                       return [all.length >= 2, at.some((own, k) => k > 0 && own.left < at[k - 1].right)]; })()";
        assert_eq!(browser.evaluate(overlap)?, json!([true, false]), "a bar of {width}");
    }
    for expression in ["0", "player.forces(true)", "player.pick(195, 300)"] {
        browser.evaluate(expression)?;
        browser.settle()?;
        assert_eq!(browser.evaluate("document.documentElement.scrollWidth")?, 390, "{expression}");
    }
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

pub(crate) fn what_a_run_has_not_is_not_offered(browser: &mut Browser) -> Result<()> {
    browser.look(WIDE)?;
    let mut alone = motions::catheter();
    alone.model.contacts.obstacles.clear();
    alone.model.segments[0].fixed = false;
    let run = alone.record("alone", 5, 10.0);
    let (_folder, path) = page(std::slice::from_ref(&run))?;
    browser.open(&path)?;
    browser.settle()?;
    let offered = "['obstacles', 'marks', 'chapter', 'layout', 'card', 'curve-legend'].filter((id) => document.getElementById(id).checkVisibility())";
    assert_eq!(browser.evaluate(offered)?, json!([]));
    // One and a half times what it was before it could do all this, the runs aside.
    let whole = std::fs::metadata(&path)?.len() as usize - serde_json::to_string(&run)?.len();
    ensure!(whole < 124_000, "the page takes {whole} bytes");
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}
