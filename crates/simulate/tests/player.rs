//! The pages of runs in a headless Chromium. Without one these tests are ignored, unless REQUIRE_CHROMIUM is set.

#[path = "all/common/mod.rs"]
mod common;

use browser::{Browser, Look};
use common::{run, texts};

fn a_browser_plays_the_pages_of_runs(browser: &mut Browser) -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    browser.look(Look { width: 600, height: 500, phone: false, dark: false })?;
    for (scene, steps) in [("knot", "30"), ("tree-70", "60"), ("helix-on-plane", "5")] {
        let out = folder.path().join(scene);
        let output =
            run(&[scene, "--steps", steps, "--view", "--trajectory", "--quiet", "--out", out.to_str().expect("UTF-8")]);
        assert_eq!(texts(&output), (Some(0), "", ""), "{scene}");
        browser.open(&out.join("view.html"))?;
        let exact = export::read_trajectory(&out.join("trajectory.safetensors"))?;
        assert_eq!(browser.evaluate("player.frames")?, exact.states.len(), "{scene}");
        let precision = view::read_run(&out.join("view.json"))?.position_precision();
        let last = exact.states.len() - 1;
        for (i, x) in exact.states[last].positions.iter().enumerate().step_by(7) {
            let shown: [f64; 3] =
                serde_json::from_value(browser.evaluate(&format!("player.position(0, {last}, {i})"))?)?;
            let off = (0..3).map(|axis| (shown[axis] - x[axis]).abs()).fold(0.0, f64::max);
            assert!(off <= precision * (1.0 + 1e-9), "{scene}, {i}: {off} m");
        }
        let start = browser.screenshot(Some("#picture"))?;
        browser.evaluate("player.play()")?;
        browser.wait_for("player.frame > 0")?;
        browser.evaluate("player.pause()")?;
        browser.settle()?;
        assert_eq!(browser.evaluate("Number(scrubber.value) === player.frame")?, true, "{scene}");
        browser.evaluate(&format!("player.seek({last})"))?;
        browser.settle()?;
        assert_ne!(browser.screenshot(Some("#picture"))?, start, "{scene}");
    }
    assert_eq!(browser.complaints, [""; 0]);
    Ok(())
}

browser::tests![a_browser_plays_the_pages_of_runs];
