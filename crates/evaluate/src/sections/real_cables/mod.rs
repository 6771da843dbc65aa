//! Real cables: how near predictions come to recordings of them.

mod key;
mod show;

use std::path::Path;

use anyhow::{Context as _, Result, anyhow};
use correction::correction::Correction;
use correction::film::{Film, Guess};
use correction::inputs::Kind;
use correction::inside::{self, Law};
use correction::moments::Moments;
use correction::network::Shape;
use correction::training::{Plan, Trained, train};
use identify::cable::{Cable, Resolution};
use identify::fit::{Search, Stage, fit_finer};
use identify::motions::{Way, faster, halves, kinds};
use identify::page::Predicted;
use identify::parameter::{Parameter, Parameters};
use identify::predict::{Prediction, predict};
use identify::recording::{Reading, Recording, files, read_all};
use report::Section as PageSection;

use crate::cells::Section;
use crate::context::{Context, Size};
use key::{CableKey, Errors, FEWER, Measured, Method};

/// A cable's recordings, and what is known of it.
struct Known {
    cable: String,
    train: Vec<Recording>,
    eval: Vec<Recording>,
    parameters: Parameters,
    seconds: f64,
    /// The correction that was learned last from all recordings with their simulations.
    learned: Option<(Plan, Correction)>,
}

/// Remembers the cable that it was last asked for.
#[derive(Default)]
pub(crate) struct RealCables {
    known: Option<Known>,
}

/// What is looked at on the way to a law inside the simulation: runs that grow.
const STAGES: [Stage; 3] = [
    Stage { frames: Some(100), every: 4, iterations: 4 },
    Stage { frames: None, every: 4, iterations: 5 },
    Stage { frames: None, every: 2, iterations: 2 },
];
/// Hidden numbers of the perceptron that says moments.
const HIDDEN: usize = 4;
/// Kinds of motion that recordings are sorted into.
const KINDS: usize = 8;

const METHODS: [Method; 22] = [
    Method::Blend,
    Method::Identified,
    Method::Refined(4, 1),
    Method::Refined(1, 4),
    Method::Corrected(3),
    Method::Corrected(2),
    Method::Corrected(1),
    // Takes the correction of the one before.
    Method::ToAndFro(20),
    Method::By(Kind::Recurrent),
    Method::By(Kind::Graph),
    Method::WithoutPhysics(Kind::Perceptron),
    Method::WithoutPhysics(Kind::Recurrent),
    Method::OtherMotions,
    Method::FasterMotions,
    Method::Fewer(FEWER[0]),
    Method::Fewer(FEWER[1]),
    Method::Fewer(FEWER[2]),
    Method::Fewer(FEWER[3]),
    Method::Fewer(FEWER[4]),
    Method::Fewer(FEWER[5]),
    Method::Inside { moments: false },
    Method::Inside { moments: true },
];

/// Sizes of networks that are compared on the first cable: widths, for a graph network with the blocks.
const PERCEPTRONS: [usize; 4] = [32, 64, 128, 256];
const RECURRENT: [usize; 3] = [40, 80, 160];
const GRAPHS: [[usize; 2]; 5] = [[1, 32], [2, 16], [2, 32], [2, 64], [4, 32]];

/// All sizes that are compared, with the seeds that each is trained with: those that train fast with three.
fn sizes() -> Vec<Method> {
    let shape = |kind, width| Shape { width, ..Shape::of(kind) };
    let perceptrons = PERCEPTRONS.map(|width| (Kind::Perceptron, shape(Kind::Perceptron, width)));
    let recurrent = RECURRENT.map(|width| (Kind::Recurrent, shape(Kind::Recurrent, width)));
    let graphs = GRAPHS.map(|[blocks, width]| (Kind::Graph, Shape { blocks, ..shape(Kind::Graph, width) }));
    let all = perceptrons.into_iter().chain(recurrent).chain(graphs);
    let seeds = |kind| if kind == Kind::Perceptron { 1..=3 } else { 1..=1 };
    all.flat_map(|(kind, shape)| seeds(kind).map(move |seed| Method::Size { kind, shape, seed })).collect()
}

impl Section for RealCables {
    type Key = CableKey;
    type Value = Measured;
    const ID: &'static str = "real-cables";

    fn keys(&self, context: &Context) -> Result<Vec<CableKey>> {
        let Some(folder) = &context.recordings else {
            return Err(anyhow!(
                "real-cables needs --recordings DIR, a folder with a folder of recordings for each cable"
            ));
        };
        let wrong = || format!("--recordings: {}", folder.display());
        let entries =
            std::fs::read_dir(folder).with_context(wrong)?.collect::<Result<Vec<_>, _>>().with_context(wrong)?;
        let mut cables: Vec<_> = entries.into_iter().map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
        cables.sort();
        let methods = context.size.pick(&METHODS[..2], &METHODS);
        let mut keys = Vec::new();
        for (index, path) in cables.iter().enumerate() {
            let recordings_blake3 = hash(path)?;
            let cable = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let key = |&method: &Method| CableKey {
                cable: cable.clone(),
                recordings_blake3: recordings_blake3.clone(),
                method,
            };
            keys.extend(methods.iter().map(key));
            // Sizes of networks are compared on one cable.
            if index == 0 && context.size == Size::Full {
                keys.extend(sizes().iter().map(key));
            }
        }
        if keys.is_empty() {
            return Err(anyhow!("no folders of cables")).with_context(wrong);
        }
        Ok(keys)
    }

    fn seconds(&self, key: &CableKey) -> f64 {
        match key.method {
            Method::Blend => 1.0,
            Method::Identified => 60.0,
            Method::Refined(..) => 8.0,
            Method::Corrected(_) | Method::WithoutPhysics(Kind::Perceptron) => 60.0,
            Method::By(_) | Method::WithoutPhysics(_) => 200.0,
            Method::OtherMotions => 130.0,
            Method::FasterMotions => 65.0,
            Method::Fewer(count) => 2.0 * count as f64,
            Method::ToAndFro(times) => times as f64,
            Method::Inside { .. } => 200.0,
            Method::Size { .. } => 60.0,
        }
    }

    fn go_together(key: &CableKey, next: &CableKey) -> bool {
        key.cable == next.cable
    }

    fn measure(
        &mut self,
        context: &Context,
        key: &CableKey,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Measured>> {
        if self.known.as_ref().is_none_or(|known| known.cable != key.cable) {
            let Some(folder) = &context.recordings else { return Ok(None) };
            self.known = known(&folder.join(&key.cable), &key.cable, go_on)?;
        }
        let Some(known) = &mut self.known else { return Ok(None) };
        known.measure(key.method, go_on)
    }

    fn show(&self, context: &Context, cells: &[(&CableKey, &Measured)]) -> Result<PageSection> {
        Ok(show::page_section(context, cells))
    }
}

/// Hash of all recordings of a cable.
fn hash(folder: &Path) -> Result<String> {
    let mut hasher = blake3::Hasher::new();
    for path in files(&["train", "eval"].map(|part| folder.join(part)))? {
        hasher.update(path.file_name().unwrap_or_default().as_encoded_bytes());
        hasher.update(&std::fs::read(&path).with_context(|| path.display().to_string())?);
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// Reads a cable's recordings and identifies it; `None` where it was stopped.
fn known(folder: &Path, cable: &str, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Known>> {
    let read = |part: &str| -> Result<Vec<Recording>> {
        let (recordings, faults) = read_all(&files(&[folder.join(part)])?, Reading::default());
        match faults.into_iter().next() {
            Some(fault) => Err(fault.into()),
            None => Ok(recordings),
        }
    };
    let (train, eval) = (read("train")?, read("eval")?);
    let began = std::time::Instant::now();
    let Some(parameters) = identified(&train, go_on)? else { return Ok(None) };
    let seconds = began.elapsed().as_secs_f64();
    Ok(Some(Known { cable: cable.to_owned(), train, eval, parameters, seconds, learned: None }))
}

fn identified(recordings: &[Recording], go_on: &mut dyn FnMut() -> bool) -> Result<Option<Parameters>> {
    let [coarse, fine] = [Resolution::SEARCH, Resolution::PREDICTION].map(|own| cables(recordings, own.segments));
    let (coarse, fine) = (coarse?, fine?);
    let finer = (fine.as_slice(), Resolution::PREDICTION.steps);
    let fit = fit_finer(recordings, &coarse, finer, &Parameters::default(), &Search::default(), &mut |_| go_on())?;
    Ok((!fit.stopped).then_some(fit.parameters))
}

/// Cables with so many segments between two markers.
fn cables(recordings: &[Recording], segments: usize) -> Result<Vec<Cable>> {
    recordings.iter().map(|recording| Ok(Cable::new(recording, segments)?)).collect()
}

/// Predictions with so many times the usual steps and segments.
fn simulated(
    recordings: &[Recording],
    parameters: &Parameters,
    [steps, segments]: [usize; 2],
) -> Result<Vec<Prediction>> {
    let usual = Resolution::PREDICTION;
    let cables = cables(recordings, segments * usual.segments)?;
    Ok(predict(&cables, parameters, usize::MAX, steps * usual.steps)?)
}

/// Recordings beside their guesses.
fn films(recordings: &[Recording], parameters: Option<&Parameters>) -> Result<Vec<(Recording, Film)>> {
    let Some(parameters) = parameters else {
        return Ok(recordings.iter().map(|recording| (recording.clone(), Film::blended(recording))).collect());
    };
    Ok(beside(recordings, &simulated(recordings, parameters, [1; 2])?))
}

/// Recordings beside their simulations.
fn beside(recordings: &[Recording], predictions: &[Prediction]) -> Vec<(Recording, Film)> {
    let film = |(recording, own): (&Recording, _)| (recording.clone(), Film::simulated(recording, own));
    recordings.iter().zip(predictions).map(film).collect()
}

fn uncorrected(films: &[(Recording, Film)]) -> Vec<Prediction> {
    films.iter().map(|(_, film)| film.uncorrected()).collect()
}

fn errors(name: &str, recordings: &[Recording], predictions: &[Prediction]) -> Errors {
    let free: Vec<usize> = recordings.first().map_or_else(Vec::new, |recording| recording.free().collect());
    let of = Predicted { name, recordings, free: &free, predictions };
    let each = of.errors();
    Errors {
        name: name.to_owned(),
        mean_cm: 100.0 * each.iter().sum::<f64>() / each.len() as f64,
        over_time: of.over_time(),
    }
}

impl Known {
    /// Measures a method; `None` where it was stopped.
    fn measure(&mut self, method: Method, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Measured>> {
        let counts = [self.train.len(), self.eval.len()];
        let began = std::time::Instant::now();
        let done = |errors: Vec<Errors>, seconds: f64| {
            Ok(Some(Measured { errors, recordings: counts, seconds, parameters: Vec::new() }))
        };
        let eval = &self.eval;
        match method {
            Method::Blend => done(vec![errors("", eval, &uncorrected(&films(eval, None)?))], 0.0),
            Method::Identified => {
                let errors = vec![errors("", eval, &simulated(eval, &self.parameters, [1; 2])?)];
                let named = Parameter::all().filter(|&of| self.parameters[of] != 0.0);
                let named = named.map(|of| (of.to_string(), self.parameters[of]));
                let (seconds, parameters) = (self.seconds, named.collect());
                Ok(Some(Measured { errors, recordings: counts, seconds, parameters }))
            }
            Method::Refined(steps, segments) => {
                done(vec![errors("", eval, &simulated(eval, &self.parameters, [steps, segments])?)], 0.0)
            }
            Method::Corrected(seed) => self.corrected(&plan(Guess::Physics, Kind::Perceptron, seed), counts, go_on),
            Method::By(kind) => self.corrected(&plan(Guess::Physics, kind, 1), counts, go_on),
            Method::WithoutPhysics(kind) => {
                let Some(correction) = learned(&films(&self.train, None)?, &plan(Guess::Blend, kind, 1), go_on)? else {
                    return Ok(None);
                };
                let predictions = corrected(&films(eval, None)?, &correction);
                done(vec![errors("", eval, &predictions)], began.elapsed().as_secs_f64())
            }
            Method::Inside { moments } => self.inside(moments, counts, go_on),
            Method::Size { kind, shape, seed } => {
                let plan = Plan { shape, members: 1, ..plan(Guess::Physics, kind, seed) };
                let Some(trained) = trained(&films(&self.train, Some(&self.parameters))?, &plan, go_on)? else {
                    return Ok(None);
                };
                let error = |(name, error): (&str, &f64)| Errors {
                    name: name.to_owned(),
                    mean_cm: 100.0 * error,
                    over_time: Vec::new(),
                };
                let errors = ["identified", "corrected"].into_iter().zip(&trained.aside[0]).map(error).collect();
                let seconds = began.elapsed().as_secs_f64();
                let count = trained.correction.reader.parameters() as f64;
                let parameters = vec![("parameters".to_owned(), count)];
                Ok(Some(Measured { errors, recordings: counts, seconds, parameters }))
            }
            Method::OtherMotions => {
                let ways: Vec<Way> = self.train.iter().map(Way::of).collect();
                let second = halves(&kinds(&ways, KINDS));
                let first = second.iter().map(|second| !second).collect();
                self.half_from_half(&[second, first], go_on)
            }
            Method::FasterMotions => self.half_from_half(&[faster(&self.train)], go_on),
            Method::Fewer(count) => self.fewer(count, go_on),
            Method::ToAndFro(times) => self.forth_and_back(times, go_on),
        }
    }

    /// The correction that is learned from all recordings with their simulations; the last one is remembered.
    fn learned(&mut self, plan: &Plan, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Correction>> {
        if let Some((_, correction)) = self.learned.as_ref().filter(|(of, _)| of == plan) {
            return Ok(Some(correction.clone()));
        }
        let correction = learned(&films(&self.train, Some(&self.parameters))?, plan, go_on)?;
        self.learned = correction.clone().map(|correction| (plan.clone(), correction));
        Ok(correction)
    }

    /// The recordings to predict, corrected.
    fn corrected(
        &mut self,
        plan: &Plan,
        recordings: [usize; 2],
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Measured>> {
        let began = std::time::Instant::now();
        let Some(correction) = self.learned(plan, go_on)? else { return Ok(None) };
        let seconds = began.elapsed().as_secs_f64();
        let predictions = corrected(&films(&self.eval, Some(&self.parameters))?, &correction);
        let errors = vec![errors("", &self.eval, &predictions)];
        Ok(Some(Measured { errors, recordings, seconds, parameters: Vec::new() }))
    }

    /// With a law inside the simulation, and corrected on top of it.
    fn inside(
        &self,
        moments: bool,
        recordings: [usize; 2],
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Measured>> {
        let began = std::time::Instant::now();
        let law = Law { curvature: true, moments: moments.then(|| Moments::new(HIDDEN, 1)) };
        let cables = |own: &[Recording]| cables(own, Resolution::SEARCH.segments);
        let Some(found) = inside::fit(&self.train, &cables(&self.train)?, &self.parameters, law, &STAGES, go_on)?
        else {
            return Ok(None);
        };
        let seconds = began.elapsed().as_secs_f64();
        let [train, eval] = [&self.train, &self.eval]
            .map(|own| -> Result<Vec<(Recording, Film)>> { Ok(beside(own, &found.predict(own, &cables(own)?)?)) });
        let (train, eval) = (train?, eval?);
        let Some(correction) = learned(&train, &plan(Guess::Physics, Kind::Perceptron, 1), go_on)? else {
            return Ok(None);
        };
        let errors = vec![
            errors("", &self.eval, &uncorrected(&eval)),
            errors("corrected", &self.eval, &corrected(&eval, &correction)),
        ];
        Ok(Some(Measured { errors, recordings, seconds, parameters: Vec::new() }))
    }

    /// Parts of the recordings to learn from, each predicted by what the other recordings say.
    fn half_from_half(&self, parts: &[Vec<bool>], go_on: &mut dyn FnMut() -> bool) -> Result<Option<Measured>> {
        let began = std::time::Instant::now();
        let mut out = Vec::new();
        let (mut count, mut corrections) = (0, [0; 2]);
        for is_predicted in parts {
            let half = |which: bool| -> Vec<Recording> {
                let own = self.train.iter().zip(is_predicted).filter(|(_, own)| **own == which);
                own.map(|(recording, _)| recording.clone()).collect()
            };
            let (own, other) = (half(false), half(true));
            let Some(parameters) = identified(&own, go_on)? else { return Ok(None) };
            let plan = plan(Guess::Physics, Kind::Perceptron, 1);
            let Some(correction) = learned(&films(&own, Some(&parameters))?, &plan, go_on)? else { return Ok(None) };
            let films = films(&other, Some(&parameters))?;
            out.push(errors("identified", &other, &uncorrected(&films)));
            out.push(errors("corrected", &other, &corrected(&films, &correction)));
            // As the program predicts: without the correction where it does not apply.
            let all: Vec<&Film> = films.iter().map(|(_, film)| film).collect();
            out.push(errors("shipped", &other, &correction.predictions(&all)));
            corrections[0] += correction.worths(&all).iter().filter(|worth| worth.applies).count();
            corrections[1] += films.len();
            count = count.max(own.len());
        }
        let seconds = began.elapsed().as_secs_f64();
        let recordings = [count, self.train.len() - count];
        let parameters = vec![("applies".to_owned(), corrections[0] as f64 / corrections[1] as f64)];
        Ok(Some(Measured { errors: out, recordings, seconds, parameters }))
    }

    /// What so many of the recordings say of those to predict.
    fn fewer(&self, count: usize, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Measured>> {
        let began = std::time::Instant::now();
        let all = self.train.len();
        let count = count.min(all);
        let own: Vec<Recording> = (0..count).map(|k| self.train[k * all / count].clone()).collect();
        let Some(parameters) = identified(&own, go_on)? else { return Ok(None) };
        let eval = films(&self.eval, Some(&parameters))?;
        let mut out = vec![errors("identified", &self.eval, &uncorrected(&eval))];
        let Some(correction) =
            learned(&films(&own, Some(&parameters))?, &plan(Guess::Physics, Kind::Perceptron, 1), go_on)?
        else {
            return Ok(None);
        };
        out.push(errors("corrected", &self.eval, &corrected(&eval, &correction)));
        let (seconds, recordings) = (began.elapsed().as_secs_f64(), [count, self.eval.len()]);
        Ok(Some(Measured { errors: out, recordings, seconds, parameters: Vec::new() }))
    }

    /// The grips' ways to and fro: errors of the first and the last way forth, on which they move as they were recorded.
    fn forth_and_back(&mut self, times: usize, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Measured>> {
        let began = std::time::Instant::now();
        let long: Vec<Recording> = self.eval.iter().map(|recording| recording.to_and_fro(times)).collect();
        let Some(correction) = self.learned(&plan(Guess::Physics, Kind::Perceptron, 1), go_on)? else {
            return Ok(None);
        };
        let films = films(&long, Some(&self.parameters))?;
        let mut out = Vec::new();
        for (name, predictions) in
            [("identified", &uncorrected(&films)), ("corrected", &corrected(&films, &correction))]
        {
            // The last way forth is the one before last where the number is even.
            for (which, pass) in [("first", 0), ("last", (times - 1) / 2 * 2)] {
                let part = |(recording, prediction): (&Recording, &Prediction)| {
                    let frames = pass * (recording.frames() - 1)..(pass + 1) * (recording.frames() - 1) + 1;
                    Prediction { markers: prediction.markers[frames].to_vec(), unsolved: 0 }
                };
                let parts: Vec<Prediction> = self.eval.iter().zip(predictions).map(part).collect();
                out.push(errors(&format!("{name}, {which} way"), &self.eval, &parts));
            }
        }
        let (seconds, recordings) = (began.elapsed().as_secs_f64(), [self.train.len(), self.eval.len()]);
        Ok(Some(Measured { errors: out, recordings, seconds, parameters: Vec::new() }))
    }
}

/// How a correction is trained: as the program `correction` does it.
fn plan(guess: Guess, kind: Kind, seed: u64) -> Plan {
    Plan { guess, kind, shape: Shape::of(kind), members: 3, epochs: kind.epochs(), seed }
}

/// Trains a correction; `None` where it was stopped.
fn trained(films: &[(Recording, Film)], plan: &Plan, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Trained>> {
    let trained = train(films, plan, &mut |_| go_on()).context("there is nothing to learn")?;
    Ok((!trained.stopped).then_some(trained))
}

/// The same without how it went.
fn learned(films: &[(Recording, Film)], plan: &Plan, go_on: &mut dyn FnMut() -> bool) -> Result<Option<Correction>> {
    Ok(trained(films, plan, go_on)?.map(|trained| trained.correction))
}

/// Corrected predictions.
fn corrected(films: &[(Recording, Film)], correction: &Correction) -> Vec<Prediction> {
    films.iter().map(|(_, film)| film.corrected(&correction.add(film))).collect()
}
