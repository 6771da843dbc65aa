//! Values of flags, and what is said where they are not allowed.

/// Most threads one may ask for: thousands take minutes to start and stop.
const MOST_THREADS: usize = 1024;

/// A finite number above zero.
///
/// # Errors
/// If it is none.
pub fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value),
        _ => Err("it must be a finite number > 0".to_owned()),
    }
}

/// A number of threads.
///
/// # Errors
/// If it is none, or too many.
pub fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count @ 1..=MOST_THREADS) => Ok(count),
        _ => Err(format!("it must be a whole number from 1 to {MOST_THREADS}")),
    }
}

/// A part `i/n` of the work, i from 0.
///
/// # Errors
/// If it is none.
pub fn shard(text: &str) -> Result<(usize, usize), String> {
    let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    parts.filter(|&(i, n)| i < n).ok_or_else(|| "it must be i/n, whole numbers with i from 0 to n - 1".to_owned())
}
