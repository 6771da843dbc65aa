//! What a program runs on.

use std::thread::available_parallelism;

/// Name of the processor and number of its cores that are to be had, such as "Example 9000 at 3 GHz, 2 cores".
pub fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let name = name.map_or(std::env::consts::ARCH, |(_, name)| name.trim());
    let cores = available_parallelism().map_or(1, |cores| cores.get());
    format!("{name}, {cores} core{}", if cores == 1 { "" } else { "s" })
}
