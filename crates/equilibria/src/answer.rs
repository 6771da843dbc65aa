//! What is answered.

use std::ops::AddAssign;

use cosserat::internals::kernels::math::Vec3;
use nalgebra::{UnitQuaternion, Vector3};

use crate::query::Query;
use crate::scaled::{Cut, Scaled, set};
use crate::sweep::Chain;

/// A force and a moment in world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Force [N].
    pub force: Vector3<f64>,
    /// Moment about the grip's position [N m].
    pub moment: Vector3<f64>,
}

impl Wrench {
    /// The force's and the moment's components.
    pub(crate) fn numbers(&self) -> [f64; 6] {
        let (f, m) = (self.force, self.moment);
        [f.x, f.y, f.z, m.x, m.y, m.z]
    }
}

/// A stable equilibrium.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Equilibrium {
    /// Centres of the segments [m].
    pub positions: Vec<Vector3<f64>>,
    /// Orientations of the segments; local z is the axis.
    pub orientations: Vec<UnitQuaternion<f64>>,
    /// What the grips give to the cable: that of the start, that of the end (zero where it is free).
    pub grips: [Wrench; 2],
    /// Energy of bending, twist and stretch, and of the weight from z = 0 [J].
    pub energy: f64,
    /// Largest moment out of balance, over B / L plus the force at the start times a segment's length, or gap at the end over
    /// L, whichever is larger.
    pub residual: f64,
}

/// The answer to a query: by equilibria of a cable, or of one with three arms.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer<E = Equilibrium> {
    /// Equilibria, the lowest first: one, or all that were found.
    pub equilibria: Vec<E>,
    /// Linear solves of all searches on the cable's own segments.
    pub solves: u32,
    /// Those on coarse levels.
    pub coarse_solves: u32,
    /// How its searches began and went.
    pub searches: Searches,
}

/// How the searches of a query began and went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Searches {
    /// Starts.
    pub starts: u32,
    /// Those at which the tangent has other negative pivots than a minimum, so that Newton's step may lead away from every equilibrium.
    pub indefinite: u32,
    /// Solves, on all levels, with a tangent that is indefinite or made stiffer until it is not.
    pub regularised: u32,
}

impl AddAssign for Searches {
    fn add_assign(&mut self, other: Self) {
        self.starts += other.starts;
        self.indefinite += other.indefinite;
        self.regularised += other.regularised;
    }
}

impl<E> Default for Answer<E> {
    fn default() -> Self {
        Self { equilibria: Vec::new(), solves: 0, coarse_solves: 0, searches: Searches::default() }
    }
}

/// Makes equilibria of turns.
pub(crate) struct Finish {
    cut: Cut,
    chain: Chain<f64>,
}

impl Finish {
    pub(crate) fn new(cut: &Cut) -> Self {
        Self { cut: *cut, chain: Chain::new(cut) }
    }

    pub(crate) fn equilibrium(
        &mut self,
        query: &Query,
        scaled: &Scaled,
        force: &Vector3<f64>,
        turns: &[UnitQuaternion<f64>],
    ) -> Equilibrium {
        let Self { cut, chain } = self;
        chain.load(0, cut, scaled);
        for (own, q) in chain.turns.iter_mut().zip(turns) {
            set(own, 0, q);
        }
        chain.force = Vec3([force.x, force.y, force.z]);
        let balance = chain.balance();
        let [moment, gap] = balance.residual;
        let residual = (moment / (1.0 + force.norm() / cut.segments as f64)).max(gap);
        let length = query.cable.length;
        let bending = query.cable.bending[0].max(query.cable.bending[1]);
        let [unit_force, unit_moment] = [bending / length.powi(2), bending / length];
        let z = Vector3::z();
        let gap = |pull: Vector3<f64>| pull * scaled.compliance;
        // Along the cable: each joint gives way to the force that it bears.
        let own_weight = |k: usize| scaled.weight * cut.length(k);
        let [carried, carried_at] = scaled.carried;
        let after = |k: usize| cut.share_after(k, carried_at);
        let (mut pull, mut place) = (*force, Vector3::zeros());
        let mut positions = Vec::with_capacity(turns.len());
        let mut lifted = 0.0;
        let mut stretched = 0.0;
        for (k, q) in turns.iter().enumerate() {
            let axis = q * z * cut.length(k);
            stretched += 0.5 * scaled.compliance * pull.norm_squared();
            // Whether what is carried was borne before this segment, and is after it.
            let borne = [k > 0 && after(k - 1) > 0.0, after(k) > 0.0];
            let to_it = if borne[0] { Vector3::zeros() } else { gap(pull) } + axis * (1.0 - after(k));
            lifted += carried * to_it.z;
            place += gap(pull) + axis * 0.5;
            positions.push(query.start.position + place * length);
            lifted += own_weight(k) * place.z;
            place += axis * 0.5;
            pull += z * own_weight(k);
            if borne[0] != borne[1] {
                pull += z * carried;
            }
        }
        let end = if scaled.held { pull } else { Vector3::zeros() };
        stretched += 0.5 * scaled.compliance * end.norm_squared();
        let world = |q: &UnitQuaternion<f64>, m: Vec3<f64>| q * Vector3::from(m.0);
        let grips = [
            Wrench { force: -force * unit_force, moment: world(&scaled.ends[0], balance.moments[0]) * unit_moment },
            Wrench { force: end * unit_force, moment: world(&scaled.ends[1], balance.moments[1]) * unit_moment },
        ];
        let lift = (query.cable.weight * length + query.cable.carried.weight) * query.start.position.z;
        let energy = (balance.energy + lifted + stretched) * unit_moment + lift;
        Equilibrium { positions, orientations: turns.to_vec(), grips, energy, residual }
    }
}
