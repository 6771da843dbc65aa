//! Exploration.
use std::time::Instant;
use identify::{cable::*, fit::*, metric::*, parameter::*, predict::*, recording::*};
fn main() {
    let cable = std::env::args().nth(1).unwrap();
    let held: Vec<(Parameter, f64)> = std::env::args().skip(2).map(|a| { let (n, v) = a.split_once('=').unwrap(); (n.parse().unwrap(), v.parse().unwrap()) }).collect();
    let var = |n: &str, d: f64| std::env::var(n).ok().map_or(d, |v| v.parse().unwrap());
    let parts = var("PARTS", 3.0) as usize; let steps = var("STEPS", 1.0) as usize;
    let load = |part: &str| {
        let paths = files(&[format!("/work/shared/real/deform/{cable}/{part}").into()]).unwrap();
        let (good, bad) = read_all(&paths, Reading::default());
        bad.iter().for_each(|e| println!("{e}"));
        let cables: Vec<_> = good.iter().map(|r| Cable::new(r, parts).unwrap()).collect();
        (good, cables)
    };
    let (train, cables) = load("train");
    let (eval, eval_cables) = load("eval");
    println!("{} {}", train.len(), eval.len());
    let mut start = Parameters::default();
    for (p, v) in &held { start[*p] = *v; }
    let show = |p: &Parameters| Parameter::ALL.iter().map(|&k| format!("{k} {:.4}", p[k])).collect::<Vec<_>>().join("  ");
    let score = |p: &Parameters, steps: usize| {
        let t = Instant::now();
        let pr = predict(&eval_cables, p, 500, steps).unwrap();
        let mut e: Vec<f64> = eval.iter().zip(&pr).map(|(r, q)| mean_error(r, q) * 100.0).collect();
        let mean = e.iter().sum::<f64>() / e.len() as f64; 
        let worst: Vec<String> = { let mut w: Vec<_> = e.iter().zip(&eval).collect(); w.sort_by(|a,b| b.0.total_cmp(a.0)); w.iter().take(3).map(|(e, r)| format!("{} {e:.2}", r.name())).collect() };
        e.sort_by(f64::total_cmp);
        println!("   eval mean {mean:.3} median {:.3} worst {worst:?} unsolved {} {:.2} s", e[e.len()/2], pr.iter().map(|q| q.unsolved).sum::<usize>(), t.elapsed().as_secs_f64());
    };
    score(&start, steps);
    if std::env::var("NOFIT").is_ok() { 
        let t = Instant::now();
        let p = predict(&eval_cables[..1], &start, 500, steps).unwrap();
        println!("one: {:.3} s, unsolved {}", t.elapsed().as_secs_f64(), p[0].unsolved);
        return; }
    let stages = std::env::var("STAGES").unwrap_or("100,250,500".into()).split(',').map(|s| s.parse().unwrap()).collect();
    let search = Search { free: Parameter::ALL.into_iter().filter(|p| std::env::var("ALLFREE").is_ok() || !held.iter().any(|(q, _)| q == p)).collect(), stages, huber: var("HUBER", 0.005), steps, ..Search::default() };
    let t = Instant::now();
    let fit = fit(&train, &cables, &start, &search, &mut |i| { println!("{:.1}s {} {} loss {:.4e} {}", t.elapsed().as_secs_f64(), i.stage, i.iteration, i.loss, show(&i.parameters)); true }).unwrap();
    println!("{:.1} s {}", t.elapsed().as_secs_f64(), show(&fit.parameters));
    score(&fit.parameters, steps);
    let pr = predict(&cables, &fit.parameters, 500, steps).unwrap();
    let e: Vec<f64> = train.iter().zip(&pr).map(|(r, q)| mean_error(r, q) * 100.0).collect();
    println!("train mean {:.3}", e.iter().sum::<f64>() / e.len() as f64);
    let sum = total(&fit.normals);
    println!("sd (if independent 1 mm): {:?}", sum.matrix.clone().try_inverse().map(|m| m.diagonal().map(|d| d.sqrt() * 0.01).as_slice().to_vec()));
}
