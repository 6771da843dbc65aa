//! A picture of a player page in a headless Chromium: `cargo run -p cosserat-view --example photograph -- out/view.html helix.png`

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::{Context, Result};
use browser::{Browser, Look, Picture};
use clap::Parser;

/// Takes a picture of a player page: of one frame, or of several side by side
#[derive(Parser)]
struct Args {
    /// The page, as `simulate --view` writes it
    page: PathBuf,
    /// The picture to write, PNG
    picture: PathBuf,
    /// Frames to show, from left to right
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', default_value = "0")]
    frames: Vec<u64>,
    /// Width of a frame's picture [px]
    #[arg(long, value_name = "PIXELS", default_value = "800")]
    width: u32,
    /// Height of the picture [px]
    #[arg(long, value_name = "PIXELS", default_value = "600")]
    height: u32,
    /// The whole page with its buttons, not the rods alone
    #[arg(long)]
    whole: bool,
    /// As a phone shows it
    #[arg(long)]
    phone: bool,
    /// In dark colours
    #[arg(long)]
    dark: bool,
    /// What to do before, in JavaScript; the page's `player` is its handle
    #[arg(long, value_name = "JAVASCRIPT", default_value = "")]
    script: String,
}

fn main() -> Result<()> {
    let args = Args::parse();
    let Args { width, height, phone, dark, .. } = args;
    let mut browser = Browser::start()?;
    browser.look(Look { width, height, phone, dark })?;
    let took = browser.open(&args.page.canonicalize().with_context(|| args.page.display().to_string())?)?;
    if !args.whole {
        // The rods fill the window, without what stands around them.
        browser.evaluate("view.style.cssText = 'position: fixed; inset: 0; z-index: 9'; legend.hidden = true; 0")?;
        browser.settle()?;
    }
    browser.evaluate(&format!("{{ {} }}; 0", args.script))?;
    let mut pictures = Vec::with_capacity(args.frames.len());
    for frame in args.frames {
        browser.evaluate(&format!("player.seek({frame})"))?;
        browser.settle()?;
        pictures.push(browser.screenshot(if args.whole { None } else { Some("#picture") })?);
    }
    let png = Picture::beside(&pictures)?.encode()?;
    export::write_atomically(&args.picture, |out| out.write_all(&png))?;
    println!("{}: the page was ready after {took:.2?}", args.picture.display());
    browser.complaints.iter().for_each(|complaint| println!("{complaint}"));
    Ok(())
}
