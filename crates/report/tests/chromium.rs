//! The pages of evidence on a phone. Without Chromium these tests are ignored, unless REQUIRE_CHROMIUM is set.

use std::path::Path;

use browser::{Browser, Look};

fn pages_do_not_scroll_sideways_on_a_phone(browser: &mut Browser) -> anyhow::Result<()> {
    browser.look(Look { width: 390, height: 844, phone: true, dark: false })?;
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../report").canonicalize()?;
    for page in ["", "solvers", "tangent", "equilibria", "branched", "real"] {
        // Pages of text say nothing of being ready: a frame shows each.
        let address = folder.join(page).join("index.html");
        browser.show(&address)?;
        assert_eq!(browser.evaluate("document.documentElement.scrollWidth")?, 390, "{}", address.display());
        assert!(browser.evaluate("document.body.innerText.length")?.as_u64() > Some(1000), "{}", address.display());
    }
    Ok(())
}

browser::tests![pages_do_not_scroll_sideways_on_a_phone];
