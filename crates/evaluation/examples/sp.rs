use solver::formulation::Formulation;
fn main() {
    let f: Formulation = std::env::args().nth(1).unwrap_or("xpbd-geometric".into()).parse().unwrap();
    for c in evaluation::stress::cases() {
        if c.name.contains("tree") {
            continue;
        }
        match evaluation::stress::run(&c, f) {
            Ok(r) => println!(
                "{:48} n {:6} {:22} fin {} its {:6.2} retr {:4} dE {:9.2e} len {:8.2e} rs {:8.1e} rb {:8.1e} {:.3}s",
                r.case,
                r.segments,
                r.status,
                r.finite,
                r.iterations_per_step,
                r.retries,
                r.energy_rise,
                r.length_drift,
                r.worst_stretch,
                r.worst_bend,
                r.seconds
            ),
            Err(e) => println!("{} {e}", c.name),
        }
    }
}
