use std::sync::Arc;

use component::{Component, split};
use kernels::Spatial;
use nalgebra::Vector3;
use rod::{Assembly, Friction, Material, RodSpec, Sheath};

use super::*;
use crate::duplicates::shapes;
use crate::geometry::World;
use crate::key::{Feature, key, words};

/// A bent tube of six segments and a wire of one inside, off its middle, with the centre beyond a mouth or not.
fn one(beyond: bool) -> (Vec<Component<f64>>, Vec<Shape>, Tube) {
    let material = Material { youngs_modulus: 1e6, torsion_modulus: 1e6, density: 1000.0 };
    let mut assembly = Assembly::new(Vector3::zeros());
    let node = |k: usize| Vector3::new((0.3 * k as f64).sin(), 0.05 * k as f64, 1.0 - (0.3 * k as f64).cos());
    let outer = assembly.rod(&RodSpec::new((0..=6).map(node).collect(), 0.2, material));
    let along = if beyond { (node(6) - node(5)).normalize() * 0.2 } else { Vector3::zeros() };
    let middle = if beyond { node(6) } else { (node(3) + node(4)) * 0.5 } + along + Vector3::new(0.01, 0.04, 0.03);
    let axis = Vector3::new(0.03, 0.01, 0.05);
    let inner = assembly.rod(&RodSpec::new(vec![middle - axis, middle + axis], 0.05, material));
    let sheath = Sheath { inner, outer, clearance: 0.06, friction: Friction::default() };
    assembly.model_mut().contacts.sheaths.push(sheath.clone());
    let (model, state) = assembly.finish();
    model.validate(&state).unwrap();
    let (members, topologies): (Vec<_>, Vec<_>) = split(&model).into_iter().unzip();
    let sets = members.iter().zip(topologies).map(|(members, topology)| {
        let mut set = Component::new(&model, &state, Arc::new(topology), &[members]);
        set.predict(0.0, 1e-3, component::Formulation::Xpbd);
        set
    });
    let (sets, shapes) = (sets.collect(), shapes(&model, members.iter()));
    let mut tube = Tube::new(&model, &sheath);
    tube.follow(&shapes, &sets);
    (sets, shapes, tube)
}

/// The gap changes as the contact's bodies move by their shares: the wall's force does the work that the gap says.
#[test]
fn the_force_is_the_gradient_of_the_gap() {
    for beyond in [false, true] {
        let (mut sets, shapes, tube) = one(beyond);
        let inside: Vec<_> = tube.inside().collect();
        let [(inner, place)] = inside[..] else { panic!("{inside:?}") };
        let tubes = [tube];
        let evaluate = |sets: &Vec<Component<f64>>| {
            let mut contact = Contact::new((inner, Partner::Sheath(0), Feature::Nearest), Friction::default(), 0.05);
            contact.place = place;
            let world = World { shapes: &shapes, obstacles: &[], bodies: &[], tubes: &tubes };
            contact.evaluate(&world, sets, Poses::Now);
            contact
        };
        // Where the wall leans its distance is the gap where they touch alone.
        for _ in 0..if beyond { 20 } else { 0 } {
            let contact = evaluate(&sets);
            let Shape { component, body, .. } = shapes[inner as usize];
            let set = &mut sets[component as usize];
            set.poses[body as usize].x -= contact.normal * contact.gap;
            set.start[body as usize] = set.poses[body as usize];
        }
        let contact = evaluate(&sets);
        assert!(!beyond || contact.gap.abs() < 1e-12, "{}", contact.gap);
        let shares: f64 = contact.others().map(|(_, _, share)| share).sum();
        assert!((shares - 1.0).abs() < 1e-12 && contact.normal.0.iter().all(|x| x.is_finite()));
        assert_eq!(key(words(contact.key)), contact.key);
        for (moved, &Shape { component, body, .. }) in shapes.iter().enumerate() {
            for direction in 0..6 {
                let kept = sets[component as usize].poses[body as usize];
                let (h, mut gaps, mut ways) = (1e-6, [0.0; 2], [Vec3::zero(); 2]);
                let mut step = Spatial { linear: Vec3::zero(), angular: Vec3::zero() };
                let axis = if direction < 3 { &mut step.linear } else { &mut step.angular };
                axis.0[direction % 3] = h;
                for (k, sign) in [1.0, -1.0].into_iter().enumerate() {
                    let pose = &mut sets[component as usize].poses[body as usize];
                    *pose = kept;
                    pose.x += step.linear * sign;
                    pose.q = pose.q.turned(step.angular * sign);
                    let contact = evaluate(&sets);
                    (gaps[k], ways[k]) = (contact.gap, contact.slip);
                }
                sets[component as usize].poses[body as usize] = kept;
                let moves = |i: u32| if i as usize == moved { step } else { Spatial::zero() };
                let relative = contact.relative(moves);
                let (found, expected) = ((gaps[0] - gaps[1]) / (2.0 * h), relative.dot(contact.normal) / h);
                assert!((found - expected).abs() < 1e-6, "beyond {beyond}, {moved}, {direction}: {found}, {expected}");
                let across = relative - contact.normal * relative.dot(contact.normal);
                let off = (ways[0] - ways[1]) * 0.5 - across;
                assert!(off.norm_squared().sqrt() < 1e-4 * h, "beyond {beyond}, {moved}, {direction}: {off:?}");
            }
        }
    }
}
