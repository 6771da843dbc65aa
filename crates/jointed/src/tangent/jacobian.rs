//! The whole Jacobian of a step's equations, which is not quite symmetric, and its factor: what derivatives are made of.
//!
//! In the unknowns (dp, y = -dlambda) of [`crate::tangent`] it is `A = [K', J^T; J', -alpha~]`. K' has in its turns' blocks
//! what K leaves out, and J' how the frames turn in which stretch is measured.
//!
//! It is eliminated from the leaves to the roots, a body and the joint at its inner end at a time: with the block Z of both,
//! B of what follows in their rows, and E of them in the rows that follow, `D <- D - E Z^-1 B`. J is its own inverse, so that
//! `Z^-1` takes the inverse of 6 x 6 numbers, `N = K_o J_o' alpha~ + J_o^T`, which are regular however small compliances are:
//! `y = N^-1 (f - K_o J_o' c)` and `dp = J_o' (alpha~ y + c)` for the right-hand sides f and c. N^-1 and K_o are all that is kept.
//! All that is held counts as one body, the root: to begin at a held end would make a spring of the first joint, beside whose
//! stiffness that of bending drowns. Joints that close loops, which may lead through what is held, come last, as a dense
//! border. Refinement follows every solve, as a dense border of what is stiff costs digits.

mod blocks;
mod factor;

use std::sync::Arc;

use nalgebra::{Matrix6, Vector3, Vector6};

use self::blocks::JointBlocks;
use super::{Equations, JointEquation};
use crate::block::Block;
use crate::topology::Topology;
use kernels::Spatial;
use kernels::lane::Real;
use kernels::math::{self, Sym3, Vec3, times};

pub use factor::Factor;

/// A number for each row, or each column, of the equations: six a body, and six a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Field<T = f64> {
    /// (dx, dphi), or force and torque, one entry a body; zero of bodies that are held, unless said otherwise.
    pub bodies: Vec<Spatial<T>>,
    /// Stretch-shear and bend-twist in world rows, one entry a joint.
    pub joints: Vec<Spatial<T>>,
}

impl<T> Default for Field<T> {
    fn default() -> Self {
        Self { bodies: Vec::new(), joints: Vec::new() }
    }
}

impl<T: Real> Field<T> {
    /// Zero.
    pub fn zero(topology: &Topology) -> Self {
        Self { bodies: vec![Spatial::zero(); topology.bodies()], joints: vec![Spatial::zero(); topology.joints.len()] }
    }

    /// The largest entries of bodies and of joints.
    #[inline(always)]
    fn sizes(&self) -> [T; 2] {
        let largest = |list: &[Spatial<T>]| {
            let mut out = T::zero();
            for x in list {
                for x in x.to_array() {
                    out = x.abs().max(out);
                }
            }
            out
        };
        [largest(&self.bodies), largest(&self.joints)]
    }

    /// Makes all of it zero.
    pub fn clear(&mut self) {
        self.bodies.fill(Spatial::zero());
        self.joints.fill(Spatial::zero());
    }

    /// Each entry with that of another one.
    #[inline(always)]
    fn with<'a>(&'a mut self, other: &'a Self) -> impl Iterator<Item = (&'a mut Spatial<T>, &'a Spatial<T>)> {
        self.bodies.iter_mut().zip(&other.bodies).chain(self.joints.iter_mut().zip(&other.joints))
    }

    /// Adds `share` times another one.
    #[inline(always)]
    fn add(&mut self, other: &Self, share: T) {
        self.with(other).for_each(|(own, other)| *own = own.plus(*other, share));
    }

    /// Sum of the products of all entries.
    fn dot(&self, other: &Self) -> T {
        let pairs = self.bodies.iter().zip(&other.bodies).chain(self.joints.iter().zip(&other.joints));
        pairs.fold(T::zero(), |sum, (a, b)| sum + a.dot(*b))
    }
}

/// The Jacobian, block by block.
#[derive(Clone, Debug)]
pub struct Jacobian<T = f64> {
    topology: Arc<Topology>,
    /// Whether a body is held, one entry a body.
    held: Vec<bool>,
    /// K' of a body with itself: its mass, and that of its turns; one where it is held.
    bodies: Vec<(T, [[T; 3]; 3])>,
    /// What is added to that, with the body.
    added: Vec<(usize, Block<T>)>,
    joints: Vec<JointBlocks<T>>,
}

impl<T: Real> Jacobian<T> {
    /// That of `equations`, with the exact blocks of the turns of each body with itself, and of each joint's stretch-shear rows
    /// with those of body a.
    pub fn new(topology: &Arc<Topology>, equations: &Equations<T>, whole: &Whole<T>) -> Self {
        let topology = topology.clone();
        let mut out = Self { topology, held: Vec::new(), bodies: Vec::new(), added: Vec::new(), joints: Vec::new() };
        out.set(equations, whole);
        out
    }

    /// Sets it to that of other equations of the same connectivity.
    pub fn set(&mut self, equations: &Equations<T>, whole: &Whole<T>) {
        self.added.clear();
        self.held.clear();
        self.held.extend(equations.bodies.iter().map(|body| body.is_held()));
        self.bodies.clear();
        self.joints.clear();
        let joint = |(joint, tilted): (&JointEquation<T>, &[[T; 3]; 3])| {
            let JointEquation { arms, compliance, coupling, .. } = *joint;
            JointBlocks { arms, tilted: *tilted, compliance, coupling }
        };
        self.joints.extend(equations.joints.iter().zip(&whole.joints).map(joint));
        let one = T::splat(1.0);
        let own = equations.bodies.iter().zip(&whole.bodies);
        self.bodies.extend(own.map(|(body, turning)| match body.is_held() {
            true => (one, Sym3::identity(one).full()),
            false => (body.mass, *turning),
        }));
    }

    /// Adds to K' of a body with itself, in all lanes.
    pub fn add(&mut self, body: usize, block: &Matrix6<f64>) {
        self.added.push((body, std::array::from_fn(|r| std::array::from_fn(|c| T::splat(block[(r, c)])))));
    }

    /// `A x`, or `A^T x`. Movements of held bodies in x count. `A x` has no rows of held bodies; in those of `A^T x` is what
    /// moving them would do.
    pub fn apply(&self, x: &Field<T>, transposed: bool, out: &mut Field<T>) {
        T::dispatch(
            #[inline(always)]
            || self.apply_all(x, transposed, out),
        );
    }

    #[inline(always)]
    fn apply_all(&self, x: &Field<T>, transposed: bool, out: &mut Field<T>) {
        let zero = Spatial::zero();
        for (i, (own, (mass, turning))) in out.bodies.iter_mut().zip(&self.bodies).enumerate() {
            let Spatial { linear, angular } = x.bodies[i];
            let turning = if transposed { math::transposed(*turning) } else { *turning };
            *own = match self.held[i] {
                true => zero,
                false => Spatial { linear: linear * *mass, angular: times(turning, angular) },
            };
        }
        for (i, block) in &self.added {
            let x = x.bodies[*i];
            let own = if transposed { blocks::tr_apply(block, x) } else { blocks::apply(block, x) };
            out.bodies[*i] = out.bodies[*i].plus(own, T::splat(1.0));
        }
        for (j, (joint, ends)) in self.joints.iter().zip(&self.topology.joints).enumerate() {
            let [a, b] = ends.map(|body| body as usize);
            let (of_a, of_b) = (x.bodies[a], x.bodies[b]);
            let mut movements = [joint.movements(0), joint.movements(1)];
            let mut forces = [joint.forces(0), joint.forces(1)];
            if transposed {
                std::mem::swap(&mut movements, &mut forces);
            }
            let (y, one) = (x.joints[j], T::splat(1.0));
            let moved = movements[0].apply(of_a).plus(movements[1].apply(of_b), one);
            out.joints[j] = moved.plus(joint.yielded(y), -one);
            let on_a = forces[0].tr_apply(y);
            let on_b = forces[1].tr_apply(y);
            out.bodies[a] = out.bodies[a].plus(on_a, one);
            out.bodies[b] = out.bodies[b].plus(on_b, one);
            out.bodies[a].angular += joint.coupling(0).apply(of_b.angular);
            out.bodies[b].angular += joint.coupling(1).apply(of_a.angular);
        }
        if !transposed {
            let held = out.bodies.iter_mut().zip(&self.held).filter(|(_, held)| **held);
            held.for_each(|(own, _)| *own = zero);
        }
    }
}

/// What K' and J' have beyond K and J: see [`super`].
#[derive(Clone, Debug)]
pub struct Whole<T = f64> {
    /// How `-g` of each body's turns falls as the body turns; zero where it is held [kg m^2].
    pub bodies: Vec<[[T; 3]; 3]>,
    /// How each joint's stretch-shear rows grow as body a turns [m].
    pub joints: Vec<[[T; 3]; 3]>,
}

impl<T> Default for Whole<T> {
    fn default() -> Self {
        Self { bodies: Vec::new(), joints: Vec::new() }
    }
}

/// A shift and a turn, or a force and a torque, in three numbers each.
pub fn split(x: Spatial<f64>) -> [Vector3<f64>; 2] {
    [Vector3::from(x.linear.0), Vector3::from(x.angular.0)]
}

/// The inverse of [`split`].
pub fn joined([linear, angular]: [Vector3<f64>; 2]) -> Spatial<f64> {
    Spatial { linear: Vec3(linear.into()), angular: Vec3(angular.into()) }
}

/// All six numbers of the first lane.
pub fn six<T: Real>(x: Spatial<T>) -> Vector6<f64> {
    Vector6::from(x.to_array().map(|x| x.lane(0)))
}

/// The inverse of [`six`], in all lanes.
pub fn of_six<T: Real>(x: &Vector6<f64>) -> Spatial<T> {
    Spatial::splat(Spatial::from_array((*x).into()))
}
