//! How fast the live view of 1,000 segments with contacts is: ten cables that fall over a box and each other, one of which a hand
//! drags. Frames a second, and the time from an input to the frame that shows it: at the socket, and in the page where there is
//! Chromium, which draws with the processor here.
//!
//! `cargo run -p cosserat-live --example live_speed`. With `-- --serve` it prints the address alone, for a browser of yours.

use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use browser::{Browser, Look};
use dynamics::simulation::{Settings, Simulation};
use live::{Options, with_hands};
use serde_json::json;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

/// Time step [s].
const DT: f64 = 1.0 / 60.0;
/// How long frames are counted [s].
const COUNTED: Duration = Duration::from_secs(5);
/// Inputs of which the time is taken.
const INPUTS: usize = 30;
/// The segment that is dragged: the middle of the last cable.
const DRAGGED: usize = 950;

/// Ten cables of 100 segments, five along x and five along y.
fn scene() -> String {
    let mut text =
        "run = { dt_s = 0.0166666666666667, steps = 1 }\ndamping = { linear_per_s = 0.5, angular_per_s = 0.5 }\n\
                    contact.friction = 0.3\n\
                    [[obstacles]]\nshape.plane = { point_m = [0, 0, 0], normal = [0, 0, 1] }\nfriction = 0.3\n\
                    [[obstacles]]\nshape.box = { sides_m = [0.6, 0.6, 0.3], centre_m = [0, 0, 0.15] }\nfriction = 0.3\n"
            .to_owned();
    for k in 0..10 {
        let (beside, height) = (0.1 * f64::from(k / 2) - 0.2, 0.35 + 0.05 * f64::from(k));
        let (start, way) = if k % 2 == 0 {
            (format!("[-1.5, {beside}, {height}]"), "[1, 0, 0]")
        } else {
            (format!("[{beside}, -1.5, {height}]"), "[0, 1, 0]")
        };
        text += &format!(
            "[[rods]]\nshape.straight = {{ start_m = {start}, direction = {way}, length_m = 3, segments = 100 }}\n\
             radius_m = 0.015\nyoungs_modulus_pa = 1e6\ntorsion_modulus_pa = 4e5\ndensity_kg_m3 = 1100\n"
        );
    }
    text
}

fn serve(told: impl FnOnce(&str)) -> Result<()> {
    let scene = scene::parse(&scene(), "cables")?;
    let model = with_hands(&scene.model);
    let mut simulation = Simulation::new(&model, &scene.state, &Settings::default(), None)?;
    let options = Options { alone: Duration::from_secs(5), ..Options::new("ten cables") };
    live::serve(&model, &mut simulation, DT, options, told, || true)?;
    Ok(())
}

/// A page's connection.
fn connect(address: &str) -> Result<WebSocket<TcpStream>> {
    let host = address.split('/').nth(2).context("an address has a host")?;
    let mut request = format!("{}socket", address.replacen("http", "ws", 1)).into_client_request()?;
    request.headers_mut().insert("Origin", format!("http://{host}").parse()?);
    Ok(tungstenite::client(request, TcpStream::connect(host)?)?.0)
}

/// The next frame.
fn frame(socket: &mut WebSocket<TcpStream>) -> Result<Vec<u8>> {
    loop {
        if let Message::Binary(bytes) = socket.read()? {
            return Ok(bytes.to_vec());
        }
    }
}

/// Of a frame: how many hands hold, the speed over real time, and where the last hand pulls to.
fn read(frame: &[u8]) -> (u32, f64, [f32; 3]) {
    let float = |at: usize| f32::from_le_bytes(std::array::from_fn(|k| frame[at + k]));
    let hands = u32::from_le_bytes(std::array::from_fn(|k| frame[8 + k]));
    let speed = f64::from_le_bytes(std::array::from_fn(|k| frame[24 + k]));
    let end = frame.len() - 12;
    (hands, speed, [0, 1, 2].map(|k| float(end + 4 * k)))
}

/// Prints the median and the largest of some times [ms].
fn print(what: &str, frames: f64, mut times: Vec<f64>) {
    times.sort_by(f64::total_cmp);
    let [median, most] = [times.len() / 2, times.len() - 1].map(|k| times[k]);
    println!(
        "{what}: {frames:.0} frames a second, from an input to the frame that shows it {median:.0} ms (median), {most:.0} ms at most"
    );
}

fn at_the_socket(address: &str) -> Result<()> {
    let mut socket = connect(address)?;
    let (begin, mut frames, mut speeds) = (Instant::now(), 0, Vec::new());
    while begin.elapsed() < COUNTED {
        let (_, speed, _) = read(&frame(&mut socket)?);
        frames += 1;
        speeds.push(speed);
    }
    speeds.retain(|speed| speed.is_finite());
    let slowest = speeds.into_iter().fold(f64::INFINITY, f64::min);
    println!("the first {} s, as the cables fall: {slowest:.2} of real time where it is slowest", COUNTED.as_secs());
    let send = |socket: &mut WebSocket<TcpStream>, input| -> Result<()> {
        Ok(socket.send(Message::text(json!({ "do": input }).to_string()))?)
    };
    send(&mut socket, json!({ "grab": { "hand": 0, "segment": DRAGGED, "at": [0.2, 0.0, 0.4] } }))?;
    let mut times = Vec::new();
    for k in 0..INPUTS {
        let to = [0.2, 0.0, 0.4 + 0.005 * k as f64];
        let begin = Instant::now();
        send(&mut socket, json!({ "move": { "hand": 0, "to": to } }))?;
        while !matches!(read(&frame(&mut socket)?), (1, _, place) if place == to.map(|x| x as f32)) {
            ensure!(begin.elapsed() < Duration::from_secs(60), "no frame shows the input");
        }
        times.push(1e3 * begin.elapsed().as_secs_f64());
    }
    print("at the socket", f64::from(frames) / COUNTED.as_secs_f64(), times);
    Ok(())
}

/// In the page: counts frames that come and pictures that show a new one, and takes the time of the script for a frame, and from a
/// moved pointer to the frame that shows where it pulls.
const WATCH: &str = "(() => {
    const seen = window.seen = { frames: 0, pictures: 0, script: 0, times: [] };
    const take = live.motion.take.bind(live.motion);
    let moved, target, drawn;
    window.addEventListener('pointermove', (event) => (moved ??= event.timeStamp), { capture: true });
    live.motion.take = (bytes) => {
        const begin = performance.now();
        const taken = take(bytes);
        seen.script += performance.now() - begin;
        seen.frames++;
        const now = JSON.stringify(live.motion.hands[0]?.[1]);
        if (now !== target && moved !== undefined) {
            seen.times.push(performance.now() - moved);
            moved = undefined;
        }
        target = now;
        return taken;
    };
    const look = () => {
        if (seen.frames !== drawn) seen.pictures++;
        drawn = seen.frames;
        requestAnimationFrame(look);
    };
    look();
})()";

fn in_chromium(address: &str, browser: &mut Browser) -> Result<()> {
    browser.look(Look { width: 1000, height: 760, phone: false, dark: false })?;
    browser.open_address(address)?;
    browser.wait_for("live.leads && live.motion.time.length > 3")?;
    browser.evaluate(WATCH)?;
    thread::sleep(COUNTED);
    let [frames, pictures, script]: [f64; 3] =
        serde_json::from_value(browser.evaluate("[seen.frames, seen.pictures, seen.script / seen.frames]")?)?;
    let place = format!("player.project(player.position(0, 0, {DRAGGED}))");
    let [x, y]: [f64; 2] = serde_json::from_value(browser.evaluate(&place)?)?;
    // Beyond where a click begins to be a drag.
    browser.press(&[[x, y], [x, y - 20.0]])?;
    for k in 1..=INPUTS {
        browser.wait_for(&format!("seen.times.length >= {k}"))?;
        browser.move_pressed([x, y - 20.0 - k as f64])?;
    }
    let times = serde_json::from_value(browser.evaluate("seen.times")?)?;
    print("in Chromium", frames / COUNTED.as_secs_f64(), times);
    println!(
        "a frame takes {script:.1} ms of the page's script; {:.0} pictures a second, drawn by the processor",
        pictures / COUNTED.as_secs_f64()
    );
    Ok(())
}

fn main() -> Result<()> {
    let measure = |address: &str| {
        let address = address.to_owned();
        thread::spawn(move || -> Result<()> {
            at_the_socket(&address)?;
            match Browser::start() {
                Ok(mut browser) => in_chromium(&address, &mut browser),
                Err(error) => {
                    println!("in Chromium: not measured ({error})");
                    Ok(())
                }
            }
        })
    };
    if std::env::args().any(|argument| argument == "--serve") {
        return serve(|address| println!("{address}"));
    }
    let mut measured = None;
    serve(|address| measured = Some(measure(address)))?;
    measured.context("the view did not begin")?.join().map_err(|_| anyhow::anyhow!("the measurement panicked"))?
}
