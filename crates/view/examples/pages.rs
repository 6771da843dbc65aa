//! Pages of made-up motions, and pictures of them in a headless Chromium, light and dark, wide and on a phone.
//!
//! `cargo run -p view --example pages -- FOLDER`

#[path = "../tests/browser/mod.rs"]
mod browser;
#[path = "../tests/motions/mod.rs"]
mod motions;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use browser::{Browser, Look};
use view::{Run, write_page};

/// Name of the page, its runs, and what is done before the picture is taken.
type Page = (&'static str, Vec<Run>, &'static str);

fn main() -> Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).context("a folder to write into is wanted")?);
    std::fs::create_dir_all(&folder)?;
    let folder = folder.canonicalize()?;
    let (calm, wild) = (motions::helix(1.0), motions::helix(2.0));
    let pages: [Page; 5] = [
        ("helix", vec![calm.record("helix, newton", 150, 30.0)], "player.seek(60)"),
        (
            "close",
            vec![wild.record("helix, newton", 150, 30.0)],
            "player.seek(60); player.colour('curvature');
             for (let i = 0; i < 6; i++) picture.dispatchEvent(new WheelEvent('wheel',
               {deltaY: -200, clientX: 0.42 * innerWidth, clientY: 0.31 * innerHeight}))",
        ),
        ("tree", vec![motions::tree().record("tree, newton", 300, 60.0)], "player.seek(200); player.colour('speed')"),
        (
            "overlaid",
            vec![calm.record("helix, newton", 150, 30.0), wild.record("helix, xpbd-geometric", 120, 30.0)],
            "player.seek(60)",
        ),
        (
            "beside",
            vec![calm.record("helix, newton", 150, 30.0), wild.record("helix, xpbd-geometric", 120, 30.0)],
            "player.seek(60); player.colour('tension'); player.beside(true)",
        ),
    ];
    for (name, runs, _) in &pages {
        let path = folder.join(format!("{name}.html"));
        write_page(&path, runs)?;
        println!("{}: {:.2} MB", path.display(), std::fs::metadata(&path)?.len() as f64 * 1e-6);
    }
    let Some(mut browser) = Browser::start()? else {
        println!("no Chromium: no pictures");
        return Ok(());
    };
    pages.iter().try_for_each(|page| photograph(&mut browser, &folder, page))
}

fn photograph(browser: &mut Browser, folder: &Path, (name, _, script): &Page) -> Result<()> {
    for phone in [false, true] {
        for dark in [false, true] {
            let (width, height) = if phone { (390, 844) } else { (1280, 800) };
            browser.look(Look { width, height, phone, dark })?;
            let took = browser.open(&folder.join(format!("{name}.html")))?;
            browser.evaluate(script)?;
            browser
                .evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())))")?;
            let picture = STANDARD.decode(browser.screenshot(None)?)?;
            let size = if phone { "phone" } else { "wide" };
            let path = folder.join(format!("{name}-{size}-{}.png", if dark { "dark" } else { "light" }));
            std::fs::write(&path, picture)?;
            println!("{}: ready after {took:.2?}", path.display());
        }
    }
    for complaint in browser.complaints.drain(..) {
        println!("{name}: {complaint}");
    }
    Ok(())
}
