use equilibria::sample::Distribution;
use equilibria::start::Curves;
use equilibria::*;
use std::time::Instant;
fn main() {
    let a: Vec<usize> = std::env::args().skip(1).map(|x| x.parse().unwrap()).collect();
    let (count, segments) = (a[0], a[1]);
    let levels = a[2..].to_vec();
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    let queries: Vec<Query> = (0..count).map(|k| Distribution::default().query(1, k as u64)).collect();
    let all = Curves::all();
    let sets = [
        ("h", Curves { sagging: false, both_twists: false, ..all }),
        ("s", Curves { hermite: false, both_twists: false, ..all }),
        ("h+s", Curves { both_twists: false, ..all }),
        ("h2", Curves { sagging: false, ..all }),
        ("s2", Curves { hermite: false, ..all }),
        ("all", all),
    ];
    let mut results = Vec::new();
    for (name, set) in sets {
        let params = Params { segments, levels: levels.clone(), ..Params::default() };
        let mut best = f64::INFINITY;
        let mut r = vec![];
        for _ in 0..3 {
            let t = Instant::now();
            r = solve_from(&queries, &params, &set).unwrap();
            best = best.min(t.elapsed().as_secs_f64() * 1e6 / count as f64);
        }
        results.push((name, best, r));
    }
    let lowest: Vec<f64> = (0..count)
        .map(|k| {
            results
                .iter()
                .filter_map(|r| r.2[k].as_ref().ok())
                .map(|a| a.equilibria[0].energy)
                .fold(f64::INFINITY, f64::min)
        })
        .collect();
    for (name, best, r) in &results {
        let ok: Vec<_> = r.iter().flatten().collect();
        let solves = ok.iter().map(|a| a.solves as f64).sum::<f64>() / ok.len() as f64;
        let low = r
            .iter()
            .zip(&lowest)
            .filter(|(a, l)| a.as_ref().is_ok_and(|a| a.equilibria[0].energy <= **l + 1e-6 * l.abs().max(1.0)))
            .count();
        println!(
            "{name:4}: {best:.1} us, solves {solves:.2}, missing {}, lowest {:.1} %",
            count - ok.len(),
            100.0 * low as f64 / count as f64
        );
    }
}
