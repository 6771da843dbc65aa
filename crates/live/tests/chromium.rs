//! The live page in a headless Chromium. Without one these tests are ignored, unless REQUIRE_CHROMIUM is set.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use browser::{Browser, Look};
use dynamics::simulation::{Settings, Simulation};
use live::{Input, Live, Options, Recording, with_hands};
use nalgebra::{UnitQuaternion, Vector3};
use rod::{Assembly, Damping, Friction, Material, Obstacle, ObstacleShape, Pose, RodSpec, Surface, shape};
use serde_json::Value;

const WIDE: Look = Look { width: 1000, height: 760, phone: false, dark: false };
const PHONE: Look = Look { width: 390, height: 844, phone: true, dark: false };

/// Height of the box [m].
const HEIGHT: f64 = 0.3;

/// A live view in a thread of its own: a rope of 1.2 m that lies on the ground before a box.
struct Shown {
    address: String,
    ends: Arc<AtomicBool>,
    thread: JoinHandle<Result<Recording, String>>,
}

impl Shown {
    fn new() -> Result<Self> {
        let ends = Arc::new(AtomicBool::new(false));
        let (told, address) = channel();
        let own = ends.clone();
        let thread = thread::spawn(move || {
            let rubber = Material { youngs_modulus: 1e6, torsion_modulus: 4e5, density: 1100.0 };
            let mut assembly = Assembly::new(Vector3::new(0.0, 0.0, -9.81));
            let begin = Vector3::new(-0.6, -0.4, 0.02);
            assembly.rod(&RodSpec::new(shape::straight(begin, Vector3::x(), 1.2, 30), 0.015, rubber));
            let (mut model, state) = assembly.finish();
            model.damping = Damping { linear: 0.5, angular: 0.5 };
            let surface = Surface { friction: Friction::new(0.3), restitution: 0.0 };
            let ground = ObstacleShape::HalfSpace { point: Vector3::zeros(), normal: Vector3::z_axis() };
            let pose = Pose { position: Vector3::new(0.0, 0.1, 0.5 * HEIGHT), orientation: UnitQuaternion::identity() };
            let block = ObstacleShape::Box { pose, sides: Vector3::new(0.5, 0.4, HEIGHT) };
            model.contacts.obstacles = [ground, block].map(|shape| Obstacle::new(shape, surface)).into();
            let model = with_hands(&model);
            let mut sim =
                Simulation::new(&model, &state, &Settings::default(), None).map_err(|error| error.to_string())?;
            let built = |model: &rod::Model| {
                Simulation::new(model, &state, &Settings::default(), None).map_err(|error| error.to_string())
            };
            let options = Options::new("rope and box");
            let rebuild: live::Rebuild<'_> = Box::new(built);
            let mut live =
                Live::open(&model, &mut sim, 0.01, Some(rebuild), options).map_err(|error| error.to_string())?;
            told.send(live.address()).map_err(|error| error.to_string())?;
            while !own.load(Ordering::Relaxed) && live.turn(&mut sim).map_err(|error| error.to_string())? {}
            Ok(live.recording())
        });
        let address = address.recv_timeout(Duration::from_secs(60)).context("the view did not begin")?;
        Ok(Self { address, ends, thread })
    }

    fn end(self) -> Result<Recording> {
        self.ends.store(true, Ordering::Relaxed);
        let recording = self.thread.join().map_err(|_| anyhow::anyhow!("the view panicked"))?;
        recording.map_err(anyhow::Error::msg)
    }
}

fn numbers<const N: usize>(value: &Value) -> Result<[f64; N]> {
    let numbers: Vec<f64> = serde_json::from_value(value.clone())?;
    numbers.try_into().ok().context("other numbers are wanted")
}

/// Where a segment is on the page [px].
fn on_page(browser: &mut Browser, segment: usize) -> Result<[f64; 2]> {
    numbers(&browser.evaluate(&format!("player.project(player.position(0, 0, {segment}))"))?)
}

/// Where a place is on the page [px].
fn projected(browser: &mut Browser, [x, y, z]: [f64; 3]) -> Result<[f64; 2]> {
    numbers(&browser.evaluate(&format!("player.project([{x}, {y}, {z}])"))?)
}

/// A place so much of the way from one to another.
fn between(from: [f64; 2], to: [f64; 2], share: f64) -> [f64; 2] {
    [0, 1].map(|k| from[k] + share * (to[k] - from[k]))
}

fn ready(browser: &mut Browser, shown: &Shown, look: Look) -> Result<()> {
    browser.look(look)?;
    browser.open_address(&shown.address)?;
    browser.wait_for("live.leads && live.motion.time.length > 3")
}

/// Saves what is seen where LIVE_PICTURES says, for a person to look at.
fn picture(browser: &mut Browser, name: &str) -> Result<()> {
    let seen = browser.screenshot(None)?;
    if let Some(folder) = std::env::var_os("LIVE_PICTURES") {
        std::fs::write(std::path::Path::new(&folder).join(format!("{name}.png")), seen.encode()?)?;
    }
    Ok(())
}

fn a_pointer_drags_a_rope_over_a_box_and_lets_go(browser: &mut Browser) -> Result<()> {
    let shown = Shown::new()?;
    ready(browser, &shown, WIDE)?;
    // Nearly along the rope, so that what is dragged goes over the box.
    browser.evaluate("document.getElementById('side').click()")?;
    for (key, shift, count) in [("-", false, 14), ("ArrowRight", true, 3), ("ArrowUp", true, 3)] {
        let event = format!("new KeyboardEvent('keydown', {{key: '{key}', shiftKey: {shift}, bubbles: true}})");
        for _ in 0..count {
            browser.evaluate(&format!("document.body.dispatchEvent({event})"))?;
        }
    }
    browser.settle()?;
    let from = on_page(browser, 15)?;
    let above = projected(browser, [0.0, -0.4, 0.7])?;
    let beyond = projected(browser, [0.35, 0.55, 0.7])?;
    browser.press(&[from])?;
    for k in 1..=10 {
        browser.move_pressed(between(from, above, 0.1 * f64::from(k)))?;
        browser.settle()?;
    }
    browser.wait_for("live.motion.hands.length === 1")?;
    browser.wait_for("player.position(0, 0, 15)[2] > 0.5")?;
    for k in 1..=10 {
        browser.move_pressed(between(above, beyond, 0.1 * f64::from(k)))?;
        browser.settle()?;
    }
    browser.wait_for("player.position(0, 0, 15)[1] > 0.2")?;
    picture(browser, "live-dragged")?;
    browser.lift(beyond)?;
    browser.wait_for("live.motion.hands.length === 0")?;
    // Its middle lies on the box then, or beyond it, and nothing is in the box.
    browser.wait_for("player.position(0, 0, 15)[2] < 0.45")?;
    let inside = "Array.from({length: 30}, (_, i) => player.position(0, 0, i))\
                  .filter(([x, y, z]) => Math.abs(x) < 0.24 && y > -0.09 && y < 0.29 && z < 0.29).length";
    assert_eq!(browser.evaluate(inside)?, 0);
    assert_eq!(browser.complaints, [""; 0]);
    let recording = shown.end()?;
    let count = |wanted: fn(&Input) -> bool| recording.inputs.iter().filter(|(_, input)| wanted(input)).count();
    assert_eq!(count(|input| matches!(input, Input::Grab { segment: 10..20, .. })), 1);
    assert_eq!(count(|input| matches!(input, Input::Drop { .. })), 1);
    ensure!(count(|input| matches!(input, Input::Move { .. })) > 5, "the pointer's way is missing");
    Ok(())
}

fn buttons_and_keys_do_what_they_say(browser: &mut Browser) -> Result<()> {
    let shown = Shown::new()?;
    ready(browser, &shown, WIDE)?;
    let click = |id: &str| format!("document.getElementById('{id}').click()");
    browser.wait_for("player_time() > 0.5".replace("player_time()", "live.motion.last").as_str())?;
    browser.evaluate(&click("play"))?;
    browser.wait_for("document.getElementById('pace').textContent === 'paused'")?;
    let steps = browser.evaluate("live.motion.steps")?;
    browser.evaluate(&click("step"))?;
    browser.wait_for(&format!("live.motion.steps === {steps} + 1"))?;
    browser
        .evaluate("document.body.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true}))")?;
    browser.wait_for(&format!("live.motion.steps === {steps} + 2"))?;
    // Back, by the slider of the last 30 seconds.
    browser.evaluate("scrubber.value = 0.3; scrubber.dispatchEvent(new Event('input'))")?;
    browser.wait_for("live.motion.steps === 25")?;
    // A pin where it was clicked.
    let place = on_page(browser, 3)?;
    browser.press(&[place])?;
    browser.lift(place)?;
    browser.wait_for("!document.getElementById('card').hidden")?;
    browser.evaluate(&click("pin"))?;
    browser.wait_for("live.pins.length === 1")?;
    // Gravity to the other side: all but the pin rises.
    browser.evaluate("knobs.hidden = false; gravity.value = -5; gravity.dispatchEvent(new Event('input'))")?;
    browser.evaluate("stiffness.value = 0.5; stiffness.dispatchEvent(new Event('change'))")?;
    let held = browser.evaluate("player.position(0, 0, live.pins[0])")?;
    browser.evaluate(&click("play"))?;
    browser.wait_for("player.position(0, 0, 29)[2] > 0.3")?;
    assert_eq!(browser.evaluate("player.position(0, 0, live.pins[0])")?, held);
    picture(browser, "live-pinned")?;
    // Arrow keys move the pin.
    let key = |kind: &str| format!("dispatchEvent(new KeyboardEvent('{kind}', {{key: 'ArrowUp', bubbles: true}}))");
    browser.evaluate(&click("drive"))?;
    browser.evaluate(&format!("document.body.{}", key("keydown")))?;
    browser.wait_for("player.position(0, 0, live.pins[0])[2] > 0.1")?;
    browser.evaluate(&format!("document.body.{}", key("keyup")))?;
    browser.evaluate(&click("again"))?;
    browser.wait_for("live.motion.steps < 30 && live.pins.length === 0")?;
    assert_eq!(browser.complaints, [""; 0]);
    shown.end().map(drop)
}

fn a_finger_drags_on_a_phone(browser: &mut Browser) -> Result<()> {
    let shown = Shown::new()?;
    ready(browser, &shown, PHONE)?;
    browser.settle()?;
    assert_eq!(browser.evaluate("document.documentElement.scrollWidth")?, 390);
    let outside = "[...document.querySelectorAll('button, select, input, canvas')]\
                   .filter((e) => e.checkVisibility() && e.getBoundingClientRect().right > 390.5).map((e) => e.id)";
    assert_eq!(browser.evaluate(outside)?, serde_json::json!([]));
    let from = on_page(browser, 15)?;
    browser.evaluate(
        "window.highest = 0; setInterval(() => (highest = Math.max(highest, player.position(0, 0, 15)[2])), 20)",
    )?;
    browser.drag(&[[from, [from[0], from[1] - 120.0]]])?;
    browser.wait_for("highest > 0.05")?;
    picture(browser, "live-phone")?;
    browser.wait_for("live.motion.hands.length === 0")?;
    // A finger beside the rope, wherever that swings by now, turns the view, and moves nothing.
    browser.evaluate("document.getElementById('play').click()")?;
    browser.wait_for("!player.plays")?;
    let mut rope = Vec::new();
    for segment in 0..30 {
        rope.push(on_page(browser, segment)?);
    }
    let distance = |y: f64| rope.iter().map(|at| (at[0] - 55.0).hypot(at[1] - y)).fold(f64::MAX, f64::min);
    let free = (3..=10).map(|k| 50.0 * f64::from(k)).max_by(|a, b| distance(*a).total_cmp(&distance(*b)));
    let free = free.filter(|&y| distance(y) > 100.0).context("the rope is everywhere")?;
    let grabs = |recording: &Recording| {
        recording.inputs.iter().filter(|(_, input)| matches!(input, Input::Grab { .. })).count()
    };
    browser.drag(&[[[20.0, free], [90.0, free + 10.0]]])?;
    assert_eq!(browser.complaints, [""; 0]);
    assert_eq!(grabs(&shown.end()?), 1);
    browser.wait_for("document.documentElement.dataset.live === 'closed'")
}

browser::tests![
    a_pointer_drags_a_rope_over_a_box_and_lets_go,
    buttons_and_keys_do_what_they_say,
    a_finger_drags_on_a_phone,
];
