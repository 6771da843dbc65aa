//! A headless Chromium, driven by its DevTools protocol: for tests and pictures of pages. WebGL is drawn in software.

mod picture;

use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use libtest_mimic::{Arguments, Trial};
use serde_json::{Value, json};
use tempfile::TempDir;
use tungstenite::{Message, WebSocket};

pub use picture::Picture;

/// Longest wait for anything; software rendering on a busy machine is slow.
const PATIENCE: Duration = Duration::from_secs(300);

/// A test with a browser of its own.
pub type Test = fn(&mut Browser) -> Result<()>;

/// The `main` of a test target without harness, of these functions, which are [`Test`]s.
#[macro_export]
macro_rules! tests {
    ($($test:ident),+ $(,)?) => {
        fn main() -> std::process::ExitCode {
            $crate::run_tests(&[$((stringify!($test), $test as $crate::Test)),+])
        }
    };
}

/// Runs tests, with the flags of any test program; one at a time, because a browser draws with all processors. Where there
/// is no Chromium they are ignored, or fail if the environment variable REQUIRE_CHROMIUM is set.
pub fn run_tests(tests: &[(&str, Test)]) -> ExitCode {
    let is_ignored = program().is_none() && std::env::var_os("REQUIRE_CHROMIUM").is_none();
    let trial = |&(name, test): &(&str, Test)| {
        let run = move || Ok(test(&mut Browser::start()?).map_err(|error| format!("{error:?}"))?);
        Trial::test(name, run).with_ignored_flag(is_ignored).with_kind(if is_ignored { "needs Chromium" } else { "" })
    };
    let arguments = Arguments { test_threads: Some(1), ..Arguments::from_args() };
    libtest_mimic::run(&arguments, tests.iter().map(trial).collect()).exit_code()
}

/// The first of the browser's names that a program goes by.
fn program() -> Option<&'static str> {
    let runs = |name: &&str| Command::new(name).arg("--version").output().is_ok();
    ["chromium", "chromium-browser", "google-chrome"].into_iter().find(runs)
}

/// What `ready` gives as soon as it gives something; `None` where that takes longer than `patience`.
fn wait<T>(patience: Duration, mut ready: impl FnMut() -> Result<Option<T>>) -> Result<Option<T>> {
    let start = Instant::now();
    while start.elapsed() < patience {
        let found = ready()?;
        if found.is_some() {
            return Ok(found);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    Ok(None)
}

/// A browser with one page. Whatever it is asked for fails if it is gone.
pub struct Browser {
    process: Child,
    socket: WebSocket<TcpStream>,
    session: String,
    last_id: u64,
    /// Errors of the console, exceptions, and requests that were refused.
    pub complaints: Vec<String>,
    _profile: TempDir,
}

/// How a page is looked at.
#[derive(Clone, Copy)]
pub struct Look {
    /// Width of the window [px].
    pub width: u32,
    /// Its height [px].
    pub height: u32,
    /// A touch screen of two pixels a point.
    pub phone: bool,
    /// Whether the page is asked for its dark colours.
    pub dark: bool,
}

impl Browser {
    /// A browser.
    ///
    /// # Errors
    /// If there is none, or if it does not start.
    pub fn start() -> Result<Self> {
        let profile = tempfile::tempdir()?;
        let mut command = Command::new(program().context("no Chromium found")?);
        command.args(["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]);
        command.args(["--remote-debugging-port=0", "--no-first-run", "--hide-scrollbars", "about:blank"]);
        command.arg(format!("--user-data-dir={}", profile.path().display()));
        let mut process = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
        // The browser writes its port and the path of its socket there.
        let place = profile.path().join("DevToolsActivePort");
        let found = wait(PATIENCE, || {
            ensure!(process.try_wait()?.is_none(), "the browser has ended");
            let text = std::fs::read_to_string(&place).unwrap_or_default();
            Ok(text.split_once('\n').map(|(port, path)| (port.to_owned(), path.trim().to_owned())))
        })?;
        let Some((port, path)) = found else {
            let _ = process.kill();
            bail!("the browser did not start");
        };
        let stream = TcpStream::connect(format!("127.0.0.1:{port}"))?;
        stream.set_read_timeout(Some(PATIENCE))?;
        let (socket, _) = tungstenite::client(format!("ws://127.0.0.1:{port}{path}"), stream)?;
        let (session, complaints) = (String::new(), Vec::new());
        let mut browser = Self { process, socket, session, last_id: 0, complaints, _profile: profile };
        let target = browser.call("Target.createTarget", json!({"url": "about:blank"}))?;
        let attached =
            browser.call("Target.attachToTarget", json!({"targetId": target["targetId"], "flatten": true}))?;
        browser.session = attached["sessionId"].as_str().context("no session")?.to_owned();
        for domain in ["Page.enable", "Runtime.enable", "Log.enable"] {
            browser.call(domain, json!({}))?;
        }
        Ok(browser)
    }

    fn call(&mut self, method: &str, params: Value) -> Result<Value> {
        self.last_id += 1;
        let mut request = json!({"id": self.last_id, "method": method, "params": params});
        if !self.session.is_empty() {
            request["sessionId"] = json!(self.session);
        }
        self.socket.send(Message::text(request.to_string()))?;
        loop {
            let Message::Text(text) = self.socket.read()? else { continue };
            let mut message: Value = serde_json::from_str(&text)?;
            if message["id"] == json!(self.last_id) {
                ensure!(message["error"].is_null(), "{method}: {}", message["error"]);
                return Ok(message["result"].take());
            }
            let params = &message["params"];
            let complains = match message["method"].as_str() {
                Some("Runtime.exceptionThrown") => true,
                Some("Runtime.consoleAPICalled") => params["type"] == "error",
                Some("Log.entryAdded") => params["entry"]["level"] == "error",
                _ => false,
            };
            if complains {
                self.complaints.push(params.to_string());
            }
        }
    }

    /// Sets size and colours; motion is reduced, so that nothing plays by itself.
    pub fn look(&mut self, Look { width, height, phone, dark }: Look) -> Result<()> {
        let scale = if phone { 2 } else { 1 };
        let metrics = json!({"width": width, "height": height, "deviceScaleFactor": scale, "mobile": phone});
        self.call("Emulation.setDeviceMetricsOverride", metrics)?;
        let features = json!([
            {"name": "prefers-color-scheme", "value": if dark { "dark" } else { "light" }},
            {"name": "prefers-reduced-motion", "value": "reduce"},
        ]);
        self.call("Emulation.setEmulatedMedia", json!({"features": features})).map(drop)
    }

    /// Runs a script before those of each page that is opened from now on.
    pub fn before_each_page(&mut self, script: &str) -> Result<()> {
        self.call("Page.addScriptToEvaluateOnNewDocument", json!({"source": script})).map(drop)
    }

    /// Opens a page from the disk, by its absolute path, and waits until it says that it is ready or has failed, in
    /// `data-state` of its root. Returns how long that took.
    ///
    /// # Errors
    /// If it fails, with what it says, or if it takes more than five minutes.
    pub fn open(&mut self, page: &Path) -> Result<Duration> {
        self.open_address(&format!("file://{}", page.display()))
    }

    /// Opens a page by its address, as [`Browser::open`].
    ///
    /// # Errors
    /// As [`Browser::open`].
    pub fn open_address(&mut self, address: &str) -> Result<Duration> {
        let start = Instant::now();
        self.call("Page.navigate", json!({"url": address}))?;
        let ready = wait(PATIENCE, || match self.evaluate("document.documentElement.dataset.state") {
            Ok(state) if state == "ready" => Ok(Some(start.elapsed())),
            Ok(state) if state == "failed" => bail!("the page failed: {}", self.evaluate("document.body.innerText")?),
            _ => Ok(None),
        });
        ready?.context("the page is not ready")
    }

    /// Shows a page from the disk, by its absolute path, and waits until all of it is there.
    pub fn show(&mut self, page: &Path) -> Result<()> {
        self.call("Page.navigate", json!({"url": format!("file://{}", page.display())}))?;
        self.wait_for("document.readyState === 'complete'")
    }

    /// The value of an expression, which may be a promise.
    ///
    /// # Errors
    /// What it throws.
    pub fn evaluate(&mut self, expression: &str) -> Result<Value> {
        let params = json!({"expression": expression, "returnByValue": true, "awaitPromise": true});
        let mut answer = self.call("Runtime.evaluate", params)?;
        ensure!(answer["exceptionDetails"].is_null(), "{expression}: {}", answer["exceptionDetails"]);
        Ok(answer["result"]["value"].take())
    }

    /// Waits until what was asked for has been drawn.
    pub fn settle(&mut self) -> Result<()> {
        let drawn = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())))";
        self.evaluate(drawn).map(drop)
    }

    /// Waits for an expression to become true.
    ///
    /// # Errors
    /// If that takes more than five minutes.
    pub fn wait_for(&mut self, expression: &str) -> Result<()> {
        let came_true = wait(PATIENCE, || Ok((self.evaluate(expression)? == true).then_some(())));
        came_true?.with_context(|| format!("{expression} did not come true"))
    }

    /// Moves fingers over a touch screen, each from one place to another [px], all at once.
    pub fn drag(&mut self, fingers: &[[[f64; 2]; 2]]) -> Result<()> {
        const MOVES: usize = 10;
        self.call("Emulation.setTouchEmulationEnabled", json!({"enabled": true, "maxTouchPoints": fingers.len()}))?;
        for k in 0..=MOVES {
            let share = k as f64 / MOVES as f64;
            let place = |(id, [from, to]): (usize, &[[f64; 2]; 2])| {
                let [x, y] = [0, 1].map(|c| from[c] + share * (to[c] - from[c]));
                json!({"x": x, "y": y, "id": id})
            };
            let places: Vec<Value> = fingers.iter().enumerate().map(place).collect();
            let kind = if k == 0 { "touchStart" } else { "touchMove" };
            self.call("Input.dispatchTouchEvent", json!({"type": kind, "touchPoints": places}))?;
        }
        self.call("Input.dispatchTouchEvent", json!({"type": "touchEnd", "touchPoints": []})).map(drop)
    }

    /// Presses the mouse at the first of some places [px], moves it through the others, and leaves it pressed at the last.
    pub fn press(&mut self, places: &[[f64; 2]]) -> Result<()> {
        for (k, [x, y]) in places.iter().enumerate() {
            let (kind, button) = if k == 0 { ("mousePressed", "left") } else { ("mouseMoved", "left") };
            let event = json!({"type": kind, "x": x, "y": y, "button": button, "buttons": 1, "clickCount": 1});
            self.call("Input.dispatchMouseEvent", event)?;
        }
        Ok(())
    }

    /// Moves the pressed mouse to a place [px].
    pub fn move_pressed(&mut self, [x, y]: [f64; 2]) -> Result<()> {
        let event = json!({"type": "mouseMoved", "x": x, "y": y, "button": "left", "buttons": 1});
        self.call("Input.dispatchMouseEvent", event).map(drop)
    }

    /// Lets the mouse go at a place [px].
    pub fn lift(&mut self, [x, y]: [f64; 2]) -> Result<()> {
        let event = json!({"type": "mouseReleased", "x": x, "y": y, "button": "left", "clickCount": 1});
        self.call("Input.dispatchMouseEvent", event).map(drop)
    }

    /// A picture of the page, or of the element that a selector names.
    ///
    /// # Errors
    /// If there is no such element.
    pub fn screenshot(&mut self, selector: Option<&str>) -> Result<Picture> {
        let mut params = json!({"format": "png"});
        if let Some(selector) = selector {
            let place = format!(
                "(({{x, y, width, height}}) => ({{x, y, width, height, scale: 1}}))\
                 (document.querySelector('{selector}').getBoundingClientRect())"
            );
            params["clip"] = self.evaluate(&place)?;
        }
        let answer = self.call("Page.captureScreenshot", params)?;
        Picture::decode(&STANDARD.decode(answer["data"].as_str().context("no picture")?)?)
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        self.session.clear();
        // The browser ends its own processes if it is asked; what is left is ended by hand.
        let _ = self.call("Browser.close", json!({}));
        let _ = wait(Duration::from_secs(10), || Ok(self.process.try_wait()?));
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
