//! Connected sets on their way back through the steps that were kept, alike ones side by side in lanes.

use std::sync::Arc;

use component::GROUP;
use component::{Alike, Members, pick_spatial};
use jointed::tangent::jacobian::split;
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::lane::{Lanes, Real};
use nalgebra::Vector3;
use rod::{Body, Model};

use super::adjoint::Adjoint;
use super::origin::Origin;
use super::run::Passed;
use super::wanted::{Pair, Wanted};
use super::{DerivativeError, HeldVariation, ObstacleVariation, StateVariation, Variation};

/// A set on its own, or several in lanes as long as they go through the same steps.
pub(super) enum Back {
    Alone(Box<Way<f64>>),
    Lanes(Box<Way<Lanes<GROUP>>>),
}

/// Sets, one a lane, and the steps that they have passed through.
pub(super) struct Way<T> {
    adjoint: Adjoint<T>,
    /// Numbers of the sets, as [`super::run::Run`] tells them.
    numbers: Vec<usize>,
    /// Steps, a list a lane.
    kept: Vec<Vec<Passed>>,
    /// The step that the way back has come to.
    at: usize,
    held: Vec<Held<T>>,
    /// The same of obstacles; none where they are not wanted.
    obstacles: Vec<Vec<Pair>>,
}

/// A body that is held.
struct Held<T> {
    body: usize,
    /// Derivatives with respect to its pose at the end of each step, and with respect to the one pose that it has where nothing
    /// moves it.
    poses: Vec<Spatial<T>>,
    base: Spatial<T>,
}

/// Runs what is the same of one and of several.
macro_rules! with {
    ($back:expr, $way:ident => $do:expr) => {
        match $back {
            Back::Alone($way) => $do,
            Back::Lanes($way) => $do,
        }
    };
}

impl Back {
    /// Those of all sets of a run, which are numbered in their order.
    ///
    /// # Errors
    /// If there are too many loops.
    pub(super) fn all(model: &Model, origin: &Origin, sets: Vec<Alike>) -> Result<Vec<Self>, DerivativeError> {
        let (mut out, mut first) = (Vec::new(), 0);
        for alike in sets {
            let numbered = (first..).zip(alike.sets.iter().cloned()).collect::<Vec<_>>();
            first += numbered.len();
            out.extend(Self::of(model, origin, (numbered, &alike.topology), alike.fill_lanes())?);
        }
        Ok(out)
    }

    /// Sets with their numbers, side by side or one by one.
    fn of(
        model: &Model,
        origin: &Origin,
        (sets, topology): (Vec<(usize, Members)>, &Arc<Topology>),
        in_lanes: bool,
    ) -> Result<Vec<Self>, DerivativeError> {
        if in_lanes {
            return Ok(vec![Self::Lanes(Box::new(Way::new(model, origin, (sets, topology))?))]);
        }
        let alone = |set| Ok(Self::Alone(Box::new(Way::new(model, origin, (vec![set], topology))?)));
        sets.into_iter().map(alone).collect()
    }

    /// Keeps what its sets have passed through, lists by their numbers.
    pub(super) fn keep(&mut self, passed: &mut [Vec<Passed>]) {
        with!(self, way => way.keep(passed));
    }

    /// Forgets all steps.
    pub(super) fn forget(&mut self) {
        with!(self, way => way.kept.iter_mut().for_each(Vec::clear));
    }

    /// Whether sets have gone through their last steps in different ways.
    pub(super) fn comes_apart(&self) -> bool {
        matches!(self, Self::Lanes(way) if way.most_alike().len() < way.kept.len())
    }

    /// The sets that go through the same steps, and the others on their own.
    ///
    /// # Errors
    /// None that was not there before.
    pub(super) fn apart(self, model: &Model, origin: &Origin) -> Result<Vec<Self>, DerivativeError> {
        let Self::Lanes(way) = self else { return Ok(vec![self]) };
        let stay = way.most_alike();
        if stay.len() == way.kept.len() {
            return Ok(vec![Self::Lanes(way)]);
        }
        let Way { adjoint, numbers, kept, .. } = *way;
        let topology = adjoint.topology().clone();
        let sets = numbers.into_iter().zip(adjoint.sets).zip(kept).enumerate();
        let (together, alone): (Vec<_>, Vec<_>) = sets.partition(|(lane, _)| stay.contains(lane));
        let mut out = Vec::new();
        let in_lanes = Alike::fills_lanes(together.len(), &topology);
        for (sets, in_lanes) in [(together, in_lanes), (alone, false)] {
            let (sets, mut kept): (Vec<_>, Vec<_>) = sets.into_iter().map(|(_, own)| own).unzip();
            for mut back in Self::of(model, origin, (sets, &topology), in_lanes)? {
                with!(&mut back, way => way.kept = kept.drain(..way.numbers.len()).collect());
                out.push(back);
            }
        }
        Ok(out)
    }

    /// Number of its sets.
    #[cfg(test)]
    pub(super) fn sets(&self) -> usize {
        with!(self, way => way.numbers.len())
    }

    /// Begins the way back at the end of a run of so many steps among so many obstacles.
    pub(super) fn begin(&mut self, steps: usize, obstacles: usize, objective: &[(usize, StateVariation)]) {
        with!(self, way => way.begin(steps, obstacles, objective));
    }

    /// Goes back through the steps that are kept.
    ///
    /// # Errors
    /// Where a step's equations are singular.
    pub(super) fn back(
        &mut self,
        model: &Model,
        objective: &[(usize, StateVariation)],
        wanted: Wanted,
    ) -> Result<(), DerivativeError> {
        with!(self, way => way.back(model, objective, wanted))
    }

    /// Ends the way back.
    pub(super) fn end(&mut self, model: &Model, objective: &[(usize, StateVariation)], out: &mut Variation) {
        with!(self, way => way.end(model, objective, out));
    }
}

impl<T: Real> Way<T> {
    fn new(
        model: &Model,
        origin: &Origin,
        (sets, topology): (Vec<(usize, Members)>, &Arc<Topology>),
    ) -> Result<Self, DerivativeError> {
        let (numbers, sets): (Vec<_>, Vec<_>) = sets.into_iter().unzip();
        let kept = sets.iter().map(|_| Vec::new()).collect();
        let adjoint = Adjoint::new(model, origin, (sets, topology))?;
        Ok(Self { adjoint, numbers, kept, at: 0, held: Vec::new(), obstacles: Vec::new() })
    }

    fn keep(&mut self, passed: &mut [Vec<Passed>]) {
        for (kept, &number) in self.kept.iter_mut().zip(&self.numbers) {
            for mut passed in passed[number].drain(..) {
                if let Some(before) = kept.last() {
                    passed.substep.share_poses(&before.substep);
                }
                kept.push(passed);
            }
        }
    }

    /// The lanes that have gone through the last step like most others: as a whole, or in the same parts.
    fn most_alike(&self) -> Vec<usize> {
        let last = |lane: usize| {
            let kept = &self.kept[lane];
            let step = kept.last().map(|passed| passed.step);
            kept.iter().rev().take_while(move |passed| Some(passed.step) == step)
        };
        let is_like =
            |a: usize, b: usize| last(a).count() == last(b).count() && last(a).zip(last(b)).all(|(a, b)| a.is_like(b));
        let like = |lane: usize| (0..self.kept.len()).filter(|&other| is_like(lane, other)).collect::<Vec<_>>();
        let all = (0..self.kept.len()).map(like);
        all.reduce(|most, other| if other.len() > most.len() { other } else { most }).unwrap_or_default()
    }

    fn begin(&mut self, steps: usize, obstacles: usize, objective: &[(usize, StateVariation)]) {
        let held = |body| Held { body, poses: vec![Spatial::zero(); steps], base: Spatial::zero() };
        self.held = self.adjoint.held().into_iter().map(held).collect();
        self.obstacles = vec![vec![[Vector3::zeros(); 2]; steps + 1]; obstacles];
        self.at = steps;
        self.adjoint.begin();
        self.adjoint.add_objective(objective, steps);
    }

    /// Comes to an earlier step.
    fn go_to(&mut self, step: usize, objective: &[(usize, StateVariation)]) {
        while self.at > step {
            self.at -= 1;
            self.adjoint.add_objective(objective, self.at);
        }
    }

    fn back(
        &mut self,
        model: &Model,
        objective: &[(usize, StateVariation)],
        wanted: Wanted,
    ) -> Result<(), DerivativeError> {
        for k in (0..self.kept[0].len()).rev() {
            self.go_to(self.kept[0][k].step + 1, objective);
            let Self { adjoint, kept, held, obstacles, .. } = self;
            let Passed { step, shares, .. } = kept[0][k];
            let substeps: Vec<_> = kept.iter().map(|kept| &kept[k].substep).collect();
            adjoint.step_back(model, &substeps, wanted).ok_or(DerivativeError::Singular { step: step + 1 })?;
            for Held { body, poses, base } in held {
                for (pose, share) in adjoint.of_held(*body).into_iter().zip(shares) {
                    let mut add = |step: usize, share: f64| poses[step] = poses[step].plus(pose, T::splat(share));
                    add(step, share);
                    if step > 0 {
                        add(step - 1, 1.0 - share);
                    }
                    *base = base.plus(pose, T::splat(1.0));
                }
            }
            for (obstacle, poses) in adjoint.of_obstacles() {
                for (pose, share) in poses.iter().zip(shares) {
                    for (frame, share) in [(step, 1.0 - share), (step + 1, share)] {
                        (0..2).for_each(|k| obstacles[*obstacle][frame][k] += pose[k] * share);
                    }
                }
            }
        }
        Ok(())
    }

    fn end(&mut self, model: &Model, objective: &[(usize, StateVariation)], out: &mut Variation) {
        self.go_to(0, objective);
        self.adjoint.end(model, out);
        for (lane, members) in self.adjoint.sets.iter().enumerate() {
            for Held { body, poses, base } in &self.held {
                self.adjoint.add_base(lane, *body, pick_spatial(base, lane), out);
                let body = match body.checked_sub(members.segments.len()) {
                    None => Body::Segment(members.segments[*body]),
                    Some(anchor) => Body::Anchor(members.anchors[anchor]),
                };
                let poses = poses.iter().map(|pose| split(pick_spatial(pose, lane))).collect();
                out.held.push(HeldVariation { body, poses });
            }
        }
        let obstacles = self.obstacles.drain(..).enumerate();
        out.obstacles.extend(obstacles.map(|(obstacle, poses)| ObstacleVariation { obstacle, poses }));
    }
}
