//! Queries answered a second, and the time of derivatives: `cargo bench -p equilibria`.
//!
//! Random queries of one seed ([`Distribution::default`]); each figure is the best of some repeats, by the clock on the wall: nothing else
//! should run beside it.

use std::time::Instant;

use equilibria::derivative::{PARAMETERS, derivatives};
use equilibria::sample::Distribution;
use equilibria::{Params, Query, solve};

const QUERIES: u64 = 4000;
const REPEATS: usize = 20;

fn main() {
    let queries: Vec<Query> = (0..QUERIES).map(|k| Distribution::default().query(1, k)).collect();
    println!("{QUERIES} queries, tolerance 1e-8, four starts, best of {REPEATS} repeats");
    println!("segments  threads  queries a second  us a query and thread  own solves a query  not found");
    for segments in [30, 50, 100, 200] {
        for threads in [1, 2] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            let params = Params { segments, ..Params::default() };
            let mut best = f64::INFINITY;
            let mut last = Vec::new();
            for _ in 0..REPEATS {
                let begin = Instant::now();
                last = pool.install(|| solve(&queries, &params)).expect("valid parameters");
                best = best.min(begin.elapsed().as_secs_f64());
            }
            let found: Vec<_> = last.iter().flatten().collect();
            let solves = found.iter().map(|answer| f64::from(answer.solves)).sum::<f64>() / found.len() as f64;
            let rate = QUERIES as f64 / best;
            let each = 1e6 * best * threads as f64 / QUERIES as f64;
            let missing = last.len() - found.len();
            println!("{segments:8}  {threads:7}  {rate:16.0}  {each:21.1}  {solves:18.2}  {missing:9}");
        }
    }
    let queries = &queries[..400];
    let answers = solve(queries, &Params::default()).expect("valid parameters");
    let mut best = f64::INFINITY;
    for _ in 0..REPEATS {
        let begin = Instant::now();
        for (query, answer) in queries.iter().zip(answers.iter().flatten()) {
            std::hint::black_box(derivatives(query, &answer.equilibria[0]));
        }
        best = best.min(begin.elapsed().as_secs_f64());
    }
    let each = 1e6 * best / queries.len() as f64;
    println!("derivatives by {PARAMETERS} parameters, 50 segments, one thread: {each:.1} us an equilibrium");
}
