use std::f64::consts::PI;

use super::*;
use crate::Section;

/// About d1, d2 and d3 [N m^2].
fn stiffness() -> Vector3<f64> {
    Vector3::new(2.0, 3.0, 1.5)
}

fn plastic(isotropic: f64, kinematic: f64) -> JointLaw {
    JointLaw::Plastic(Plasticity { moments: Vector3::new(0.5, 0.4, 0.3), isotropic, kinematic })
}

fn friction() -> JointLaw {
    JointLaw::Friction(StrandFriction { moment: 0.2, stiffness: 5.0 })
}

/// Slopes of 2, 1 and 0.4 N m^2.
fn table(unloading: Unloading) -> JointLaw {
    JointLaw::Tabulated(MomentTable { points: vec![[0.1, 0.2], [0.3, 0.4], [0.8, 0.6]], unloading })
}

fn viscoelastic() -> JointLaw {
    JointLaw::Viscoelastic(vec![MaxwellBranch { share: 0.3, time: 0.5 }, MaxwellBranch { share: 0.4, time: 0.01 }])
}

fn all() -> [JointLaw; 8] {
    [
        plastic(0.0, 0.0),
        plastic(0.1, 0.0),
        plastic(0.0, 0.2),
        plastic(0.05, 0.1),
        friction(),
        viscoelastic(),
        table(Unloading::Elastic),
        table(Unloading::Masing),
    ]
}

/// Goes through strains one after the other; moments at the end of each step, and the work.
fn go(
    law: &JointLaw,
    strains: impl Iterator<Item = Vector3<f64>>,
    dt: f64,
) -> (Vec<Vector3<f64>>, f64, InternalVariables) {
    let (mut at, mut work, mut moments) = (law.rest(), 0.0, Vec::<Vector3<f64>>::new());
    for strain in strains {
        let moment = law.answer(&stiffness(), &strain, &at, dt).moment;
        let before = moments.last().copied().unwrap_or_default();
        work += 0.5 * (moment + before).dot(&(strain - at.strain));
        law.advance(&stiffness(), &strain, &mut at, dt);
        moments.push(moment);
    }
    (moments, work, at)
}

/// To a strain and back, so many times, in steps of a thousandth.
fn cycles(amplitude: Vector3<f64>, cycles: usize) -> impl Iterator<Item = Vector3<f64>> {
    (1..=4000 * cycles).map(move |k| {
        let phase = k as f64 / 4000.0;
        let triangle = 1.0 - 4.0 * ((phase + 0.75).fract() - 0.5).abs();
        amplitude * -triangle
    })
}

#[test]
fn tangents_are_the_slopes_of_moments() {
    let here = Vector3::new(0.5, -0.3, 0.35);
    for law in all() {
        // Along one direction, for which the tangent of friction is exact.
        let (_, _, at) = go(&law, (1..=7).map(|k| here * (0.1 * f64::from(k))), 0.02);
        let answer = |strain: &Vector3<f64>| law.answer(&stiffness(), strain, &at, 0.02);
        let tangent = answer(&here).tangent;
        assert!((tangent - tangent.transpose()).norm() < 1e-12 * tangent.norm());
        assert!(tangent.symmetric_eigenvalues().min() > 0.0, "{law:?}");
        for k in 0..3 {
            let by = Vector3::ith(k, 1e-6);
            let slope = (answer(&(here + by)).moment - answer(&(here - by)).moment) / 2e-6;
            let missed = slope - tangent.column(k);
            // The tangent keeps a ten-thousandth of the elastic one.
            assert!(missed.norm() < 4e-4, "{law:?} {k}: {missed:?}");
        }
    }
}

#[test]
fn moments_stay_on_the_yield_surface() {
    for (isotropic, kinematic) in [(0.0, 0.0), (0.1, 0.0), (0.0, 0.2), (0.05, 0.1)] {
        let JointLaw::Plastic(own) = plastic(isotropic, kinematic) else { unreachable!() };
        let mut at = plastic(isotropic, kinematic).rest();
        for strain in [[0.3, 0.2, 0.3], [30.0, -20.0, 50.0], [-3.0, 1e3, 0.0], [0.0, 0.0, 0.0]].map(Vector3::from) {
            let moment = own.answer(&stiffness(), &strain, &at).moment;
            own.advance(&stiffness(), &strain, &mut at);
            let relative = moment - stiffness().component_mul(&at.parts[0]) * own.moves();
            let size = relative.component_div(&own.moments).norm() / (1.0 + at.hardening);
            assert!((size - 1.0).abs() < 1e-12, "{strain:?}: {size}");
            assert!(
                (moment - stiffness().component_mul(&(strain - at.parts[0]))).norm() < 1e-9 * moment.norm().max(1.0)
            );
        }
    }
}

#[test]
fn bending_is_bilinear_and_twist_too() {
    for (k, yields) in [(0, 0.5), (1, 0.4), (2, 0.3)] {
        for (isotropic, kinematic) in [(0.0, 0.0), (0.1, 0.0), (0.0, 0.2)] {
            let elastic = stiffness()[k];
            let end = 3.0 * yields / elastic;
            let law = plastic(isotropic, kinematic);
            let (moments, _, at) = go(&law, (1..=100).map(|step| Vector3::ith(k, end * 0.01 * f64::from(step))), 1.0);
            // The slope over the plastic curvature: of the isotropic part that about d1, by the squares of yield moments.
            let JointLaw::Plastic(own) = &law else { unreachable!() };
            let slope = isotropic * stiffness().x * (yields / 0.5_f64).powi(2) + own.moves() * elastic;
            let expected = yields + elastic * slope / (elastic + slope) * (end - yields / elastic);
            assert!((moments[99][k] / expected - 1.0).abs() < 1e-12, "{k} {isotropic} {kinematic}");
            assert!((at.parts[0][k] - (end - expected / elastic)).abs() < 1e-12);
            assert!((law.set(&at) - at.parts[0]).norm() == 0.0);
        }
    }
}

#[test]
fn loops_take_what_their_area_says() {
    // Perfect plasticity to a curvature K: 4 M_y (K - M_y / C) a cycle; with kinematic hardening 4 M_y k_p, where 2 k_p is the range of plastic
    // curvatures. Friction to +-K in a steady loop: 4 M_f (K - (M_f / s) tanh(s K / M_f)).
    let (c, y, end) = (2.0, 0.5, 0.9);
    let flow = |kinematic: f64| 4.0 * y * (end - y / c) / (1.0 + kinematic);
    let (f, s) = (0.2, 5.0);
    let of_friction = 4.0 * f * (end - f / s * (s * end / f).tanh());
    for (law, expected) in [(plastic(0.0, 0.0), flow(0.0)), (plastic(0.0, 0.2), flow(0.2)), (friction(), of_friction)] {
        let lost: Vec<[f64; 2]> = (1..=3)
            .map(|count| {
                let (_, work, at) = go(&law, cycles(Vector3::x() * end, count), 1.0);
                [work, at.dissipated]
            })
            .collect();
        for [before, after] in [0, 1].map(|k| [lost[1][k], lost[2][k]]) {
            let area = after - before;
            assert!((area / expected - 1.0).abs() < 2e-3, "{law:?}: {area} of {expected}");
        }
    }
}

#[test]
fn work_is_stored_or_lost() {
    let way = |k: usize| {
        let t = k as f64 * 2e-4;
        Vector3::new((9.0 * t).sin(), 0.7 * (14.0 * t).sin(), 0.9 * (11.0 * t).sin())
    };
    for law in all() {
        let mut at = law.rest();
        let (mut work, mut before, mut most, mut scale) = (0.0, Vector3::zeros(), 0.0_f64, 0.0_f64);
        for k in 1..=10_000 {
            let strain = way(k);
            let (lost, from) = (at.dissipated, at.strain);
            let moment = law.answer(&stiffness(), &strain, &at, 2e-4).moment;
            law.advance(&stiffness(), &strain, &mut at, 2e-4);
            work += 0.5 * (moment + before).dot(&(strain - from));
            assert!(at.dissipated >= lost - 1e-15, "{law:?}: nothing is gained");
            most = most.max((work - at.dissipated - law.stored(&stiffness(), &strain, &at)).abs());
            // What is lost in all; where nothing is, the most that is stored.
            scale = scale.max(law.stored(&stiffness(), &strain, &at));
            before = moment;
        }
        let scale = if at.dissipated > 0.0 { at.dissipated } else { scale };
        assert!(most < 2e-3 * scale, "{law:?}: {most} of {scale}");
    }
}

#[test]
fn a_step_never_gives_more_than_it_stored() {
    // With the moment at the end of the step, as implicit Euler takes it, however long steps are.
    let mut seed = 1_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
    };
    for law in all() {
        let mut at = law.rest();
        for _ in 0..2000 {
            let size = 10.0_f64.powf(2.0 * random());
            let strain = at.strain + Vector3::new(random(), random(), random()) * size;
            let dt = 10.0_f64.powf(3.0 * random());
            let moment = law.answer(&stiffness(), &strain, &at, dt).moment;
            let (from, stored) = (at.strain, law.stored(&stiffness(), &at.strain, &at));
            law.advance(&stiffness(), &strain, &mut at, dt);
            let gained = law.stored(&stiffness(), &strain, &at) - stored;
            let work = moment.dot(&(strain - from));
            assert!(work >= gained - 1e-9 * (work.abs() + gained.abs()), "{law:?}: {work} {gained}");
        }
    }
}

#[test]
fn the_standard_linear_solid_relaxes_and_creeps() {
    // One branch of share g and time t. Relaxation: C k (1 - g + g exp(-time / t)). Creep: M / (C (1 - g)) (1 - g exp(-(1 - g) time / t)).
    let (g, time, dt) = (0.6, 0.5, 1e-3);
    let law = JointLaw::Viscoelastic(vec![MaxwellBranch { share: g, time }]);
    let fast = |_| Vector3::x() * 0.1;
    let mut at = law.rest();
    law.advance(&stiffness(), &fast(0), &mut at, 1e-9);
    for k in 1..=1000 {
        let moment = law.answer(&stiffness(), &fast(k), &at, dt).moment.x;
        law.advance(&stiffness(), &fast(k), &mut at, dt);
        let expected = 0.2 * (1.0 - g + g * (-f64::from(k) * dt / time).exp());
        assert!((moment / expected - 1.0).abs() < 1e-8, "{k}: {moment} {expected}");
    }
    let (moment, mut at, mut strain) = (0.2, law.rest(), 0.1);
    law.advance(&stiffness(), &(Vector3::x() * strain), &mut at, 1e-9);
    for k in 1..=1000 {
        // The moment is linear in the strain.
        let Answer { moment: now, tangent } = law.answer(&stiffness(), &(Vector3::x() * strain), &at, dt);
        strain += (moment - now.x) / tangent[(0, 0)];
        law.advance(&stiffness(), &(Vector3::x() * strain), &mut at, dt);
        let expected = moment / (2.0 * (1.0 - g)) * (1.0 - g * (-(1.0 - g) * f64::from(k) * dt / time).exp());
        assert!((strain / expected - 1.0).abs() < 1e-5, "{k}: {strain} {expected}");
    }
}

#[test]
fn whole_sections_flow_at_their_plastic_moments() {
    // By sums over strips of the section, and over rings.
    let (radius, stress, strips) = (2e-3_f64, 250e6, 20_000);
    let strip = 2.0 * radius / f64::from(strips);
    let places = (0..strips).map(|k| -radius + (f64::from(k) + 0.5) * strip);
    let moment: f64 = places.map(|y: f64| 2.0 * (radius * radius - y * y).sqrt() * y.abs() * strip * stress).sum();
    let torque: f64 = (0..strips)
        .map(|k| (f64::from(k) + 0.5) * 0.5 * strip)
        .map(|r| 2.0 * PI * r * r * 0.5 * strip * stress / 3.0_f64.sqrt())
        .sum();
    let own = Plasticity::fully_plastic(Section::Circle { radius }, stress).unwrap();
    assert!((own.x / moment - 1.0).abs() < 1e-4 && own.x == own.y, "{own:?} {moment}");
    assert!((own.z / torque - 1.0).abs() < 1e-4, "{own:?} {torque}");
    let square = Plasticity::fully_plastic(Section::Rectangle { width: 1.0, height: 1.0 }, 3.0_f64.sqrt()).unwrap();
    assert!((square.z - 1.0 / 3.0).abs() < 1e-15 && (square.x - 0.25 * 3.0_f64.sqrt()).abs() < 1e-15);
    assert!(Plasticity::fully_plastic(Section::Ellipse { width: 1.0, height: 2.0 }, 1.0).is_none());
}

/// Moment of the table, beyond its end too.
fn curve(curvature: f64) -> f64 {
    match curvature {
        k if k <= 0.1 => 2.0 * k,
        k if k <= 0.3 => 0.2 + (k - 0.1),
        k => 0.4 + 0.4 * (k - 0.3),
    }
}

#[test]
fn a_table_is_followed_about_any_axis_and_back_by_its_rule() {
    for axis in [Vector3::x(), Vector3::y(), Vector3::new(0.6, -0.8, 0.0)] {
        let most = 1.1;
        let way = (1..=400).map(|k| most * (1.0 - (1.0 - f64::from(k) / 200.0).abs()));
        for unloading in [Unloading::Elastic, Unloading::Masing] {
            let (moments, _, at) = go(&table(unloading), way.clone().map(|k| axis * k), 1.0);
            for (step, (moment, k)) in moments.iter().zip(way.clone()).enumerate() {
                let expected = match unloading {
                    Unloading::Masing if step >= 200 => curve(most) - 2.0 * curve(0.5 * (most - k)),
                    _ => curve(k),
                };
                assert!((moment - axis * expected).norm() < 1e-12, "{unloading:?} {step}: {moment} {expected}");
            }
            assert_eq!(at.dissipated > 0.0, unloading == Unloading::Masing);
        }
    }
}

#[test]
fn a_steady_loop_of_masings_rule_takes_its_area() {
    // 8 times the energy of the curve less 4 times moment and curvature at the end.
    let most = 0.7;
    let energy = (0..10_000).map(|k| curve(most * (f64::from(k) + 0.5) / 1e4) * most / 1e4).sum::<f64>();
    let expected = 8.0 * energy - 4.0 * most * curve(most);
    let law = table(Unloading::Masing);
    let lost = [1, 2].map(|count| go(&law, cycles(Vector3::y() * most, count), 1.0).2.dissipated);
    assert!(((lost[1] - lost[0]) / expected - 1.0).abs() < 1e-3, "{lost:?} {expected}");
}

#[test]
fn where_strain_and_moment_do_not_go_together_a_table_gives_the_strain_between() {
    for unloading in [Unloading::Elastic, Unloading::Masing] {
        let law = table(unloading);
        let (_, _, at) = go(&law, [0.4, 0.9].into_iter().map(|k| Vector3::y() * k), 1.0);
        let resolvent = Vector3::new(2.0, 2.0, 1.5) * 0.1;
        let (strain, moment) = (Vector3::new(0.1, -0.5, 0.2), Vector3::new(0.3, 0.2, -0.1));
        let here = law.resolve(&stiffness(), [&strain, &moment], &at);
        let own = law.answer(&stiffness(), &here, &at, 1.0).moment;
        let off = own + resolvent.component_mul(&here) - moment - resolvent.component_mul(&strain);
        assert!(off.norm() < 1e-12, "{unloading:?}: {off}");
        let own = law.answer(&stiffness(), &strain, &at, 1.0).moment;
        assert!((law.resolve(&stiffness(), [&strain, &own], &at) - strain).norm() < 1e-12);
    }
}

#[test]
fn tables_that_do_not_rise_or_get_steeper_are_refused() {
    let table =
        |points: &[[f64; 2]], unloading| JointLaw::Tabulated(MomentTable { points: points.to_vec(), unloading });
    for points in [&[][..], &[[0.0, 1.0]], &[[1.0, f64::NAN]], &[[1.0, 1.0], [1.0, 2.0]], &[[1.0, 1.0], [2.0, 1.0]]] {
        assert!(table(points, Unloading::Elastic).mistake().is_some(), "{points:?}");
    }
    let stiffens = &[[1.0, 1.0], [2.0, 3.0]];
    assert!(table(stiffens, Unloading::Elastic).mistake().is_none());
    assert!(table(stiffens, Unloading::Masing).mistake().is_some());
}
