//! What dual numbers say on the way back: of drag, and of velocities as they are told.

use std::sync::Arc;

use component::{BodyBar, BodyGradient, Component, Group, Members};
use dynamics::substep::Substep;
use jointed::tangent::jacobian::{joined, of_six};
use jointed::topology::Topology;
use kernels::Spatial;
use kernels::dual::Dual;
use kernels::lane::Real;
use kernels::math::Vec3;
use nalgebra::{Vector3, Vector6};
use rod::Model;

use super::origin::Origin;
use super::parameter_gradient::ParameterGradient;
use super::replay::component;
use super::wanted::Wanted;

/// A connected set in dual numbers.
pub(super) struct Duals {
    component: Component<Dual<6>>,
    groups: &'static [Group],
}

impl Duals {
    pub(super) fn new(model: &Model, Origin { state, integrator }: &Origin, set: (&Members, &Arc<Topology>)) -> Self {
        let component: Component<Dual<6>> = component(model, state, *integrator, (&[set.0], set.1));
        let groups = if component.has_steps() { &Group::ALL[..] } else { &Group::ALL[..2] };
        Self { component, groups }
    }

    /// Adds what velocities at the end of a step, as they are told, change by with the state there; returns what moments of
    /// inertia do, one entry a segment.
    pub(super) fn tell(&mut self, substep: &Substep, told: &[Spatial<f64>], bars: &mut [BodyBar]) -> Vec<Vector3<f64>> {
        let Self { component, groups } = self;
        component.begin_at(&substep.begin);
        component.set_forces(substep.interval.time + substep.interval.dt);
        component.still_forces();
        component.predict_step(substep.interval);
        component.place_constant(&substep.poses, &substep.lambda);
        component.end_solved_step();
        if substep.begins_anew {
            component.begin_anew(Dual::splat(1.0));
        }
        let along = |component: &Component<Dual<6>>, body: usize| {
            Vector6::from_fn(|k, _| joined(component.velocity_along(body, k)).dot(told[body]))
        };
        let free: Vec<usize> = (0..component.segments()).filter(|&body| !component.is_still(body)).collect();
        for &group in *groups {
            component.seed_group(group, 1.0);
            for &body in &free {
                bars[body].add(group, of_six(&along(component, body)));
            }
            component.seed_group(group, 0.0);
        }
        component.seed_inertias(1.0);
        let mut moments = vec![Vector3::zeros(); component.segments()];
        for &body in &free {
            let own = along(component, body);
            moments[body] = own.fixed_rows::<3>(1).into();
        }
        component.seed_inertias(0.0);
        moments
    }

    /// Adds what the drag of a step changes by with its start and, in a lane of the gains, with parameters; `gradients` are those of
    /// bodies.
    pub(super) fn drag_back<T: Real>(
        &mut self,
        substep: &Substep,
        (model, members, lane): (&Model, &Members, usize),
        (inverse_mass, gradients, wanted): (&dyn Fn(usize) -> f64, &mut [BodyGradient<f64>], Wanted),
        start: &mut [BodyBar],
        out: &mut ParameterGradient<T>,
    ) {
        let Self { component, groups } = self;
        let free: Vec<usize> = (0..component.segments()).filter(|&body| !component.is_still(body)).collect();
        // Mass and moments in the step are what drag makes of them.
        let of_drag: Vec<(Spatial<f64>, [f64; 2])> = gradients
            .iter_mut()
            .enumerate()
            .map(|(body, own)| {
                let Vec3([x, y, _]) = own.moments;
                let inverse_mass = inverse_mass(body);
                let bars = [-own.mass / (inverse_mass * inverse_mass), x + y];
                own.mass = 0.0;
                (own.moments.0[0], own.moments.0[1]) = (0.0, 0.0);
                (own.drag, bars)
            })
            .collect();
        let mut pass = |seed: &mut dyn FnMut(&mut Component<Dual<6>>, f64),
                        each: &mut dyn FnMut(usize, Vector6<f64>)| {
            component.begin_at(&substep.begin);
            component.set_forces(substep.interval.time + substep.interval.dt);
            component.still_forces();
            seed(component, 1.0);
            component.evaluate_drag_step(substep.interval);
            for &body in &free {
                let (impulse, [of_mass, of_transverse]) = &of_drag[body];
                each(
                    body,
                    Vector6::from_fn(|k, _| {
                        let (own, [mass, transverse]) = component.drag_along(body, k);
                        joined(own).dot(*impulse) + mass * of_mass + transverse * of_transverse
                    }),
                );
            }
            seed(component, 0.0);
        };
        for &group in *groups {
            pass(&mut |component, by| component.seed_group(group, by), &mut |body, own| {
                start[body].add(group, of_six(&own));
            });
        }
        if wanted.segments {
            pass(&mut |component, by| component.seed_inertias(by), &mut |body, own| {
                gradients[body].mass += own[0];
                gradients[body].own_moments += Vec3([own[1], own[2], own[3]]);
            });
        }
        if wanted.surroundings {
            pass(&mut |component, by| component.seed_gravity_and_damping(by), &mut |_, own| {
                out.add_surroundings_in(lane, own.fixed_rows::<3>(0).into(), [own[3], own[4]]);
            });
            if let Some(air) = &model.air {
                pass(&mut |component, by| component.seed_air(members, model, air, by), &mut |_, own| {
                    let of_air = &mut out.air[lane];
                    of_air.density += own[0];
                    of_air.normal_drag += own[1];
                    of_air.tangential_drag += own[2];
                    of_air.wind += own.fixed_rows::<3>(3);
                });
            }
        }
        if wanted.loads {
            // Of loads on the same segment one after the other.
            for rank in 0.. {
                let mut seeded = Vec::new();
                let mut found = vec![Vector6::zeros(); gradients.len()];
                let mut seed = |component: &mut Component<Dual<6>>, by: f64| {
                    if by != 0.0 {
                        seeded = component.seed_loads(rank);
                    }
                };
                pass(&mut seed, &mut |body, own| found[body] = own);
                if seeded.is_empty() {
                    break;
                }
                for (index, body) in seeded {
                    let own = &found[body];
                    out.add_load(index, [own.fixed_rows::<3>(0).into(), own.fixed_rows::<3>(3).into()]);
                }
            }
        }
    }
}
