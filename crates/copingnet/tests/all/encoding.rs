//! From states to inputs and from outputs to multipliers: what must not change them, and what must come back.

use crate::moving::scenes::{advance, moved, zeros};
use crate::moving::{KINDS, Prepared, apart, in_motion, lying, numbers, prepared};
use copingnet::{Head, Inputs};
use graph::{Normal, corrections, planar_normal};
use kernels::Spatial;
use kernels::math::Vec3;
use nalgebra::{UnitQuaternion, Vector3};

#[test]
fn rigid_motions_turn_predictions_along() {
    for kind in &KINDS[1..] {
        for which in 0..4 {
            let (model, state) = in_motion(which);
            let turn = UnitQuaternion::from_euler_angles(0.5, 1.0, 2.0);
            let (turned, turned_state) = moved(&model, &state, turn, Vector3::new(10.0, 20.0, -3.0));
            let found = prepared(*kind, &turned, &turned_state).predicted();
            let mut expected = prepared(*kind, &model, &state).predicted();
            for dlambda in &mut expected {
                dlambda.linear = Vec3((turn * Vector3::from(dlambda.linear.0)).into());
            }
            let errors = apart(&found, &expected);
            assert!(errors.iter().all(|&error| error < 1e-6), "{kind:?} {which}: {errors:?}");
        }
    }
}

#[test]
fn multiples_of_the_right_hand_side_multiply_predictions() {
    for kind in &KINDS[1..] {
        for which in 0..4 {
            let (model, state) = in_motion(which);
            let mut prepared = prepared(*kind, &model, &state);
            let expected = prepared.predicted();
            // A power of two changes no digit.
            for factor in [0.25, 1024.0, 0.0] {
                let own = prepared.component.system.joints.clone();
                for joint in &mut prepared.component.system.joints {
                    joint.rhs = Spatial::zero().plus(joint.rhs, factor);
                }
                let expected: Vec<_> = expected.iter().map(|x| Spatial::zero().plus(*x, factor)).collect();
                assert!(prepared.predicted() == expected, "{kind:?} {which} {factor}");
                prepared.component.system.joints = own;
            }
        }
    }
}

#[test]
fn planar_rods_get_planar_multipliers() {
    for kind in KINDS {
        // In the planes of x and z and of y and z, whose normals are d2 and d1.
        for (level, normal) in [(Vector3::x(), Normal::D2), (Vector3::y(), Normal::D1)] {
            let across = if normal == Normal::D2 { 1 } else { 0 };
            let (model, mut state) = lying(level);
            advance(&model, &mut state, 7);
            assert_eq!(planar_normal(&model, &state), Some(normal));
            let mut prepared = prepared(kind, &model, &state);
            let predicted = prepared.predicted();
            assert!(predicted.iter().all(|x| x.linear.0[across] == 0.0), "{kind:?} {normal:?}");
            for dlambda in predicted {
                let bend = dlambda.angular.0;
                assert!(bend[2] == 0.0 && bend[1 - across] == 0.0, "{kind:?} {normal:?} {dlambda:?}");
            }
        }
    }
}

#[test]
fn turned_planes_keep_multipliers_within_rounding() {
    let (model, state) = in_motion(3);
    let first = state.orientations[0] * Vector3::y();
    for kind in KINDS {
        let mut prepared = prepared(kind, &model, &state);
        let predicted = prepared.predicted();
        let mut planar = predicted.clone();
        for dlambda in &mut planar {
            let stretch = Vector3::from(dlambda.linear.0);
            dlambda.linear = Vec3((stretch - first * first.dot(&stretch)).into());
            dlambda.angular = Vec3([0.0, dlambda.angular.0[1], 0.0]);
        }
        let errors = apart(&predicted, &planar);
        assert!(errors.iter().all(|&error| error < 1e-12), "{kind:?}: {errors:?}");
    }
}

#[test]
fn targets_stand_for_the_exact_solution() {
    for kind in KINDS {
        for which in 0..4 {
            let (model, state) = in_motion(which);
            let mut prepared = prepared(kind, &model, &state);
            prepared.encode();
            let Prepared { component, encoder, .. } = &mut prepared;
            let (mut nodes, mut edges) = (Vec::new(), Vec::new());
            encoder.targets(component, &mut nodes, &mut edges);
            let mut found = zeros(component.dlambda.len());
            encoder.dlambda(component, [&nodes, &edges], &mut found);
            let errors = apart(&found, &component.dlambda);
            // Single precision; the head with turns neglects the compliance of stretch, some 1e-6 of what it keeps.
            let allowed = if kind.1 == Head::Semi { [1e-5, 1e-8] } else { [1e-7; 2] };
            assert!(errors.iter().zip(allowed).all(|(error, allowed)| *error < allowed), "{kind:?} {which} {errors:?}");

            let (mut dp, mut expected) = (zeros(prepared.component.poses.len()), zeros(prepared.component.poses.len()));
            corrections(&prepared.component, &prepared.component.dlambda, &mut expected);
            prepared.encoder.dp(&prepared.component, [&nodes, &edges], &prepared.component.dlambda, &mut dp);
            assert!(apart(&dp, &expected).iter().all(|&error| error < 1e-7));
        }
    }
}

#[test]
fn adjoints_are_the_gradients_of_the_multipliers() {
    for kind in KINDS {
        for which in 0..4 {
            let (model, state) = in_motion(which);
            let mut prepared = prepared(kind, &model, &state);
            prepared.encode();
            let [n, m] = prepared.outputs(kind.1);
            let Prepared { component, encoder, .. } = &mut prepared;
            let spatial = |row: &[f32]| Spatial::from_array([0, 1, 2, 3, 4, 5].map(|k: usize| f64::from(row[k])));
            let gradient: Vec<Spatial<f64>> =
                numbers(6 * component.dlambda.len(), 3.0).chunks(6).map(spatial).collect();
            let (mut nodes, mut edges) = (vec![f32::NAN; n], vec![f32::NAN; m]);
            encoder.adjoint(component, &gradient, &mut nodes, &mut edges);
            let found = [nodes, edges].concat();
            // The map is affine: a difference over any step is exact.
            let mut outputs = vec![0.0; n + m];
            let (mut below, mut above) = (zeros(gradient.len()), zeros(gradient.len()));
            let mut expected = Vec::new();
            for k in 0..n + m {
                for (value, dlambda) in [(-1.0, &mut below), (1.0, &mut above)] {
                    outputs[k] = value;
                    encoder.dlambda(component, [&outputs[..n], &outputs[n..]], dlambda);
                }
                outputs[k] = 0.0;
                let each = above.iter().zip(&below).zip(&gradient).map(|((a, b), g)| a.plus(*b, -1.0).dot(*g));
                expected.push(0.5 * each.sum::<f64>());
            }
            let largest = expected.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
            let errors = found.iter().zip(&expected).map(|(&a, b)| (f64::from(a) - b).abs());
            let error = errors.fold(0.0_f64, f64::max);
            assert!(error < 1e-7 * largest, "{kind:?} {which}: {error:e} of {largest:e}");
        }
    }
}

#[test]
fn only_first_calls_allocate() {
    for kind in KINDS {
        for which in [2, 3] {
            let (model, state) = in_motion(which);
            let Prepared { encoder, component, .. } = &mut prepared(kind, &model, &state);
            let mut inputs = Inputs::default();
            let (mut nodes, mut edges) = (Vec::new(), Vec::new());
            let (mut dlambda, mut dp) = (zeros(component.dlambda.len()), zeros(component.poses.len()));
            let mut calls = || {
                encoder.encode(component, &mut inputs);
                encoder.encode_changing(component, &mut inputs);
                encoder.targets(component, &mut nodes, &mut edges);
                encoder.dlambda(component, [&nodes, &edges], &mut dlambda);
                encoder.dp(component, [&nodes, &edges], &dlambda, &mut dp);
                encoder.adjoint(component, &dlambda, &mut nodes, &mut edges);
            };
            calls();
            assert_eq!(allocation_counter::measure(calls).count_total, 0, "{kind:?} {which}");
        }
    }
}
