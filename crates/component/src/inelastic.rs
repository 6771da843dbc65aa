//! Joints of a component that have a law ([`rod::JointLaw`]): their moment and tangent where poses are, and what they remember.
//!
//! A joint's rows are `dk + alpha~ dlambda = -(k + alpha~ lambda)` where it is elastic. With the moment M(k) of a law and its tangent K = dM/dk
//! they become, `h` being the step of implicit Euler, linearised at the strain that [`JointLaw::resolve`] gives, which comes to k:
//!
//! ```text
//! dk + S dlambda = -S (lambda + l h^2 M(k))      S = K^-1 / (l h^2)
//! ```
//!
//! So solvers see a compliance, full in the frame of the rows, that is made anew in each evaluation. Residuals are measured with the
//! elastic compliance, which does not change as joints begin to yield. Internal variables are those of the step's start until it is accepted.
//! An equilibrium is the end of a step without an end; modes swing about it with what joints answer suddenly ([`Pace`]).
//! Sets with such joints are never in lanes.

mod step;

use std::sync::Arc;

use jointed::system::{JointTerms, System};
use kernels::lane::Real;
use kernels::math::Vec3;
use nalgebra::Vector3;
use rod::{Answer, InternalVariables, JointLaw, Model, State};

use super::Members;
use super::parts::pick;

/// A joint with a law.
#[derive(Clone, Debug)]
struct Inelastic {
    /// Which law of the model.
    index: usize,
    joint: usize,
    law: Arc<JointLaw>,
    /// Elastic stiffnesses about d1, d2 and d3 [N m^2].
    stiffness: Vector3<f64>,
    /// Relaxation times of inner damping about them [s].
    damping: Vector3<f64>,
    /// At the start of the step.
    at: InternalVariables,
    /// Strain of the poses at the start of the step; only damped joints ask for it.
    start: Vector3<f64>,
}

/// How fast strains change, as laws see it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Pace {
    /// Within the step under way.
    #[default]
    Step,
    /// Infinitely slowly: what relaxes has done so, and inner damping takes nothing.
    Slow,
    /// At once: nothing flows, slips or relaxes.
    Sudden,
}

/// The joints with laws of a component.
#[derive(Clone, Debug, Default)]
pub(super) struct Laws {
    all: Vec<Inelastic>,
    pace: Pace,
    /// Per joint: its place in `all`; empty where no joint has a law.
    of_joint: Vec<Option<u32>>,
    /// The largest [`JointLaw::missed`] of the last evaluation.
    pub(super) missed: f64,
}

/// What a law adds to the rows of a joint.
pub(super) struct LawRows<T> {
    /// `S (lambda - lambda*)`, lambda* being the multiplier of its moment.
    pub(super) residual: Vec3<T>,
    /// The same with the elastic compliance.
    pub(super) measure: Vec3<T>,
    /// S: on the diagonal, and beside it.
    diagonal: [f64; 3],
    couplings: [f64; 3],
}

impl Laws {
    pub(super) fn new(model: &Model, state: &State, members: &Members) -> Self {
        let mut laws = Self::default();
        for (index, own) in model.laws.iter().enumerate() {
            let Ok(joint) = members.joints.binary_search(&own.joint) else { continue };
            let constants = &model.joints[own.joint];
            let damping = constants.inner_damping;
            laws.of_joint.resize(members.joints.len(), None);
            laws.of_joint[joint] = Some(laws.all.len() as u32);
            laws.all.push(Inelastic {
                index,
                joint,
                law: own.law.clone(),
                stiffness: constants.bend_twist_stiffness(),
                damping: Vector3::new(damping.bending, damping.bending, damping.twist),
                at: state.internal(index).cloned().unwrap_or_else(|| own.law.rest()),
                start: Vector3::zeros(),
            });
        }
        laws
    }

    pub(super) fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Gives a system the lists that its evaluation fills.
    pub(super) fn prepare<T: Real>(&self, system: &mut System<T>) {
        if !self.is_empty() {
            system.bend_extra.resize(self.of_joint.len(), T::zero());
            system.bend_couplings.resize(self.of_joint.len(), Vec3::zero());
        }
    }

    /// Whether joint `k` has a law.
    #[inline(always)]
    pub(super) fn has(&self, k: usize) -> bool {
        self.of_joint.get(k).is_some_and(Option::is_some)
    }

    /// Moment and tangent of joint `k`, which must have a law, at a strain [1/m], in its rows. The step is one of `dt` [s] and amounts to one of
    /// implicit Euler of `effective` [s].
    #[inline(always)]
    pub(super) fn rows<T: Real>(
        &mut self,
        k: usize,
        (strain, lambda): (Vec3<T>, Vec3<T>),
        length: T,
        [dt, effective]: [f64; 2],
    ) -> LawRows<T> {
        let own = &self.all[self.of_joint[k].map_or(0, |own| own as usize)];
        let (length, pace) = (length.lane(0), self.pace);
        let at = [pick(strain, 0).0.into(), pick(lambda, 0).0.into()];
        let ([residual, measure, diagonal, couplings], missed) = own.linearised(at, length, [pace.over(dt), effective]);
        self.missed = self.missed.max(missed);
        let [residual, measure] = [residual, measure].map(|v| Vec3(v.map(T::splat)));
        LawRows { residual, measure, diagonal, couplings }
    }
}

impl Pace {
    /// How long the change takes in a step of `dt` [s].
    #[inline(always)]
    fn over(self, dt: f64) -> f64 {
        match self {
            Self::Step => dt,
            Self::Slow => f64::INFINITY,
            Self::Sudden => 0.0,
        }
    }
}

impl<T: Real> LawRows<T> {
    /// Puts the compliance where solvers read it.
    #[inline(always)]
    pub(super) fn put(&self, terms: &mut JointTerms<T>, bend_extra: &mut T, couplings: &mut Vec3<T>) {
        let [first, second, twist] = self.diagonal;
        terms.bend = T::splat(first);
        terms.twist_extra = T::splat(twist - first);
        *bend_extra = T::splat(second - first);
        *couplings = Vec3(self.couplings.map(T::splat));
    }
}

impl Inelastic {
    /// See [`LawRows`], of a change that takes `dt` [s], none where it is zero; with it what [`JointLaw::missed`] says.
    #[inline(never)]
    fn linearised(
        &self,
        [strain, lambda]: [Vector3<f64>; 2],
        length: f64,
        [dt, effective]: [f64; 2],
    ) -> ([[f64; 3]; 4], f64) {
        let scale = length * effective * effective;
        let viscous = match dt > 0.0 {
            true => self.stiffness.component_mul(&self.damping) / dt,
            false => Vector3::zeros(),
        };
        let damping = viscous.component_mul(&(strain - self.start));
        let transmitted = lambda / -scale - damping;
        let (at, Answer { moment, mut tangent }) = match dt > 0.0 {
            true => {
                let at = self.law.resolve(&self.stiffness, [&strain, &transmitted], &self.at);
                (at, self.law.answer(&self.stiffness, &at, &self.at, dt))
            }
            false => (strain, self.law.sudden(&self.stiffness, &strain, &self.at)),
        };
        let own = moment + tangent * (strain - at);
        let off = self.law.missed(&own, &transmitted);
        let missed = (own - transmitted) * scale;
        (0..3).for_each(|i| tangent[(i, i)] += viscous[i]);
        // A law's tangent is positive definite.
        let compliance = tangent.try_inverse().unwrap_or_default() / scale;
        let residual = compliance * missed;
        let measure = missed.component_div(&(self.stiffness * scale));
        let at = |r, c| compliance[(r, c)];
        let (diagonal, couplings) = ([at(0, 0), at(1, 1), at(2, 2)], [at(0, 1), at(0, 2), at(1, 2)]);
        ([residual.into(), measure.into(), diagonal, couplings], off)
    }
}
