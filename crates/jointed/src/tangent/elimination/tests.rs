use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, SymmetricEigen, Vector3, Vector6};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::tangent::{BodyEquation, Coupling, JointEquation};
use kernels::lane::Lanes;
use kernels::math::{Sym3, Vec3};

fn stacked(x: &Spatial<f64>) -> Vector6<f64> {
    x.to_array().into()
}

fn matrix(rows: [[f64; 3]; 3]) -> Matrix3<f64> {
    Matrix3::from_fn(|r, c| rows[r][c])
}

/// A body's own share of the matrix and of the right-hand side.
fn own(body: &BodyEquation) -> (Matrix6<f64>, Vector6<f64>) {
    let mut out = Matrix6::identity();
    if body.is_held() {
        return (out, Vector6::zeros());
    }
    out.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(body.mass);
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(&matrix(body.turning.full()));
    (out, stacked(&body.defect))
}

/// A joint's Jacobian with respect to body a (`end` 0) or b (1).
fn jacobian(joint: &JointEquation, end: usize) -> Matrix6<f64> {
    let sign = if end == 0 { 1.0 } else { -1.0 };
    let mut out = Matrix6::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).fill_diagonal(sign);
    out.fixed_view_mut::<3, 3>(0, 3).copy_from(&(Vector3::from(joint.arms[end].0).cross_matrix() * -sign));
    out.fixed_view_mut::<3, 3>(3, 3).fill_diagonal(-sign);
    out
}

fn random(rng: &mut impl Rng) -> Vec3<f64> {
    Vec3([0; 3].map(|_| rng.random_range(-1.0..1.0)))
}

fn random_pair(rng: &mut impl Rng) -> Spatial<f64> {
    Spatial { linear: random(rng), angular: random(rng) }
}

fn symmetric(m: &Matrix3<f64>) -> Sym3<f64> {
    Sym3([m.m11, m.m22, m.m33, m.m12, m.m13, m.m23])
}

fn positive(rng: &mut impl Rng, size: f64) -> Sym3<f64> {
    let half = Matrix3::from_fn(|_, _| rng.random_range(-1.0..1.0));
    symmetric(&((half * half.transpose() + Matrix3::identity()) * size))
}

/// A random tree, a chain or (kind 2) a ring with branches, some of the ends held; `soft` is taken off the turns' blocks.
/// Compliances are none, of one direction, and small to large.
fn equations(rng: &mut ChaCha8Rng, kind: usize, soft: f64) -> (Topology, Equations) {
    let count = rng.random_range(1..12_usize);
    let mut ends = Vec::new();
    for k in 1..count {
        let parent = if kind == 1 || (kind == 2 && k < 5) { k - 1 } else { rng.random_range(0..k) };
        ends.push(if rng.random() { [k as u32, parent as u32] } else { [parent as u32, k as u32] });
    }
    if kind == 2 && count > 4 {
        ends.push([0, 4]);
    }
    let is_end = |body: usize| ends.iter().flatten().filter(|&&end| end as usize == body).count() < 2;
    let mut equations = Equations::default();
    for body in 0..count {
        let mass = rng.random_range(0.1..2.0);
        let turning = positive(rng, 0.1) + Sym3::identity(-soft);
        let defect = random_pair(rng);
        let held = is_end(body) && rng.random_range(0..3) == 0;
        equations.bodies.push(if held { BodyEquation::held() } else { BodyEquation { mass, turning, defect } });
    }
    for pair in &ends {
        // Where a body is held, or comes last, a joint yields at least a little.
        let is_hung = kind == 2 || pair.iter().any(|&body| equations.bodies[body as usize].is_held());
        let compliance = |rng: &mut ChaCha8Rng| match rng.random_range(0..4) {
            0 if !is_hung => Sym3::zero(),
            1 if !is_hung => Sym3::outer(Vec3([1.0, 2.0, 3.0]), 1.0),
            _ => {
                let size = 10.0_f64.powf(rng.random_range(-4.0..4.0));
                positive(rng, size)
            }
        };
        equations.joints.push(JointEquation {
            length: 1.0,
            arms: [random(rng), random(rng)],
            compliance: [compliance(rng), compliance(rng)],
            coupling: Coupling {
                symmetric: Sym3::sym_outer(random(rng), random(rng) * soft),
                half_torque: random(rng) * soft,
            },
            rhs: random_pair(rng),
        });
    }
    let held = equations.bodies.iter().map(BodyEquation::is_held).collect();
    (Topology::new(ends, held), equations)
}

/// The whole matrix and right-hand side, bodies first; unknowns of held bodies stand alone.
fn dense(topology: &Topology, equations: &Equations) -> (DMatrix<f64>, DVector<f64>) {
    let (bodies, joints) = (equations.bodies.len(), equations.joints.len());
    let mut out = DMatrix::zeros(6 * (bodies + joints), 6 * (bodies + joints));
    let mut rhs = DVector::zeros(6 * (bodies + joints));
    for (i, body) in equations.bodies.iter().enumerate() {
        let (own, vector) = own(body);
        out.fixed_view_mut::<6, 6>(6 * i, 6 * i).copy_from(&own);
        rhs.fixed_rows_mut::<6>(6 * i).copy_from(&vector);
    }
    for (j, joint) in equations.joints.iter().enumerate() {
        let row = 6 * (bodies + j);
        let ends = topology.joints[j].map(|body| body as usize);
        let is_free = ends.map(|body| !equations.bodies[body].is_held());
        for part in 0..2 {
            let at = row + 3 * part;
            out.fixed_view_mut::<3, 3>(at, at).copy_from(&-matrix(joint.compliance[part].full()));
        }
        rhs.fixed_rows_mut::<6>(row).copy_from(&stacked(&joint.rhs));
        for end in (0..2).filter(|&end| is_free[end]) {
            let block = jacobian(joint, end);
            out.fixed_view_mut::<6, 6>(row, 6 * ends[end]).copy_from(&block);
            out.fixed_view_mut::<6, 6>(6 * ends[end], row).copy_from(&block.transpose());
        }
        if is_free == [true; 2] {
            let [a, b] = ends.map(|body| 6 * body + 3);
            let coupling = matrix(joint.coupling.full());
            out.fixed_view_mut::<3, 3>(a, b).copy_from(&coupling);
            out.fixed_view_mut::<3, 3>(b, a).copy_from(&coupling.transpose());
        }
    }
    (out, rhs)
}

/// All unknowns, in the order of the whole matrix.
fn solution(elimination: &Elimination) -> DVector<f64> {
    let multipliers = elimination.multipliers.iter().map(|&x| -x);
    let blocks: Vec<f64> =
        elimination.corrections.iter().copied().chain(multipliers).flat_map(Spatial::to_array).collect();
    DVector::from_vec(blocks)
}

#[test]
fn chains_trees_and_rings_agree_with_a_dense_solve_and_its_inertia() {
    let rng = &mut ChaCha8Rng::seed_from_u64(5);
    let (mut right, mut wrong, mut worst_unmended) = (0, 0, 0.0);
    for trial in 0..300 {
        let soft = rng.random_range(0.0..1.0);
        let (topology, equations) = equations(rng, trial % 3, soft);
        let (matrix, rhs) = dense(&topology, &equations);
        let mut elimination = Elimination::new(&topology).unwrap();
        assert!(elimination.solve(&equations));
        let values = SymmetricEigen::new(matrix.clone()).eigenvalues;
        let negative = values.iter().filter(|&&value| value < 0.0).count();
        let is_right = negative == 6 * equations.joints.len();
        assert_eq!(elimination.mended == 0.0, is_right, "trial {trial}: {negative} of {}", rhs.len());
        if !is_right {
            let mut unmended = Elimination::new(&topology).unwrap();
            let wrong = unmended.solve_as_it_is(&equations);
            assert_eq!(wrong, Some(negative - 6 * equations.joints.len()), "trial {trial}");
            assert_eq!(unmended.mended, 0.0);
            let expected = matrix.clone().lu().solve(&rhs).unwrap();
            let error = (solution(&unmended) - &expected).norm() / expected.norm();
            // Bodies are taken in turn whatever their pivots.
            worst_unmended = f64::max(worst_unmended, error);
        }
        *(if is_right { &mut right } else { &mut wrong }) += 1;
        if !is_right {
            // Heavier bodies are in their own rows: those of the joints hold as they are.
            let found = solution(&elimination);
            let residual = (&matrix * &found - &rhs).rows_range(6 * equations.bodies.len()..).amax();
            let error = residual / (matrix.amax() * found.amax());
            assert!(error < 1e-9, "trial {trial}: rows of joints: {error:e}");
            continue;
        }
        let expected = matrix.lu().solve(&rhs).unwrap();
        let error = (solution(&elimination) - &expected).norm() / expected.norm().max(f64::MIN_POSITIVE);
        assert!(error < 1e-9, "trial {trial}: {error:e}");
        let mut left = equations.clone();
        left.subtract(&topology.joints, &elimination.corrections, &elimination.multipliers);
        let of_bodies = left.bodies.iter().filter(|body| !body.is_held()).map(|body| body.defect);
        let left = of_bodies.chain(left.joints.iter().map(|joint| joint.rhs));
        let worst = left.map(|x| stacked(&x).norm()).fold(0.0, f64::max);
        assert!(worst < 1e-8, "trial {trial}: {worst:e} is left");
    }
    assert!(right > 50 && wrong > 50, "{right} {wrong}");
    assert!(worst_unmended < 1e-6, "{worst_unmended:e}");
}

/// Without compliance nothing is lost: the constraints hold after the step to rounding errors, where bodies are held to
/// the share of their movement that a joint yields there at least.
#[test]
fn joints_without_compliance_are_closed() {
    let rng = &mut ChaCha8Rng::seed_from_u64(6);
    let mut held = 0;
    for trial in 0..150 {
        let (topology, mut equations) = equations(rng, trial % 3, 0.0);
        let loose = trial % 2 == 0;
        equations.bodies.iter_mut().filter(|body| loose && body.is_held()).for_each(|body| body.mass = 1.0);
        for body in &mut equations.bodies {
            body.turning = positive(rng, 0.1);
        }
        let is_tree = topology.elimination.is_some();
        // In a ring one joint is left to close it.
        let rigid = if is_tree { 0.. } else { 1.. };
        for joint in &mut equations.joints[rigid.clone()] {
            joint.compliance = [Sym3::zero(); 2];
        }
        let held_here = equations.bodies.iter().filter(|body| body.is_held()).count();
        // Two bodies that are held are not always as far from each other as the joints ask for.
        if held_here > 1 || (held_here == 1 && !is_tree) {
            continue;
        }
        held += held_here;
        let mut elimination = Elimination::new(&topology).unwrap();
        assert!(elimination.solve(&equations));
        assert_eq!(elimination.mended, 0.0);
        let transmitted: f64 = elimination.multipliers.iter().map(|x| stacked(x).norm()).sum();
        let tolerance = if is_tree && held_here == 0 { 1e-11 } else { 1e-7 * transmitted };
        for (joint, ends) in equations.joints.iter().zip(&topology.joints).skip(rigid.start) {
            let [a, b] = ends.map(|body| stacked(&elimination.corrections[body as usize]));
            let gap = jacobian(joint, 0) * a + jacobian(joint, 1) * b - stacked(&joint.rhs);
            assert!(gap.norm() < tolerance, "{gap}");
        }
    }
    assert!(held > 10);
}

/// Chains long enough for their ends to be far heavier, as they are felt through the joints, than one of their bodies.
#[test]
fn long_chains_agree_with_a_dense_solve() {
    let rng = &mut ChaCha8Rng::seed_from_u64(7);
    for (stiff, count) in [(1e-6, 90), (1.0, 90), (1e6, 61)] {
        let ends: Vec<[u32; 2]> = (1..count).map(|k| [k - 1, k]).collect();
        let mut equations = Equations::default();
        for body in 0..count {
            let defect = random_pair(rng);
            let free = BodyEquation { mass: 1.0, turning: positive(rng, 0.1), defect };
            equations.bodies.push(if body == 0 { BodyEquation::held() } else { free });
        }
        for _ in &ends {
            equations.joints.push(JointEquation {
                length: 1.0,
                arms: [Vec3([0.5, 0.0, 0.0]) + random(rng) * 0.1, Vec3([-0.5, 0.0, 0.0])],
                compliance: [positive(rng, 1e-3 / stiff), positive(rng, 1.0 / stiff)],
                coupling: Coupling { symmetric: Sym3::zero(), half_torque: random(rng) * 0.01 },
                rhs: random_pair(rng),
            });
        }
        let held = equations.bodies.iter().map(BodyEquation::is_held).collect();
        let topology = Topology::new(ends, held);
        assert!(topology.fold > 20);
        let mut elimination = Elimination::new(&topology).unwrap();
        assert!(elimination.solve(&equations));
        assert_eq!(elimination.mended, 0.0);
        let (matrix, rhs) = dense(&topology, &equations);
        let residual = &matrix * solution(&elimination) - &rhs;
        let error = residual.norm() / rhs.norm();
        // What the held body adds to the stiffness takes as many digits of the mass.
        assert!(error < 1e-9_f64.max(1e-12 * stiff), "{stiff:e}: {error:e}");
    }
}

/// Other right-hand sides are solved for with the last factor, whatever was held or made heavier on the way.
#[test]
fn other_right_hand_sides_take_the_last_factor() {
    let rng = &mut ChaCha8Rng::seed_from_u64(10);
    let mut mended = 0.0;
    for trial in 0..300 {
        let soft = if trial % 3 == 0 { 0.6 } else { 0.0 };
        let (topology, mut equations) = equations(rng, trial % 2, soft);
        let mut elimination = Elimination::new(&topology).unwrap();
        assert!(elimination.solve(&equations));
        equations.bodies.iter_mut().for_each(|body| body.defect = random_pair(rng));
        equations.joints.iter_mut().for_each(|joint| joint.rhs = random_pair(rng));
        assert!(elimination.solve_again(&equations));
        let mut anew = Elimination::new(&topology).unwrap();
        assert!(anew.solve(&equations));
        mended += anew.mended;
        let [found, expected] = [&elimination, &anew].map(solution);
        let error = (found - &expected).norm() / expected.norm().max(f64::MIN_POSITIVE);
        assert!(error < 1e-9, "trial {trial}: {error:e}");
    }
    assert!(mended > 10.0, "{mended}");
}

/// Where signs are wrong there is a step all the same, and it goes down the energy of bodies without joints.
#[test]
fn a_body_in_an_unstable_place_is_made_heavier() {
    let rng = &mut ChaCha8Rng::seed_from_u64(8);
    let topology = Topology::new(Vec::new(), vec![false]);
    for _ in 0..20 {
        let (turning, defect) = (positive(rng, 0.1) + Sym3::identity(-1.0), random_pair(rng));
        let equations = Equations {
            bodies: vec![BodyEquation { mass: 1.0, turning, defect }],
            joints: Vec::new(),
            ..Equations::default()
        };
        let mut elimination = Elimination::new(&topology).unwrap();
        assert!(elimination.solve(&equations));
        let is_stable = matrix(turning.full()).symmetric_eigenvalues().min() > 0.0;
        assert_eq!(elimination.mended, f64::from(!is_stable));
        assert!(defect.dot(elimination.corrections[0]) > 0.0);
    }
}

#[test]
fn what_is_not_finite_is_not_solved() {
    let rng = &mut ChaCha8Rng::seed_from_u64(9);
    let (topology, equations) = (0..).map(|_| equations(rng, 1, 0.0)).find(|(t, _)| t.fold > 1).unwrap();
    for body in 0..topology.bodies() {
        let mut broken = equations.clone();
        broken.bodies[body].mass = f64::NAN;
        assert!(!Elimination::new(&topology).unwrap().solve(&broken));
    }
}

/// Lanes never mix: each has the bits of its system alone, whatever is mended, held or not finite beside it.
#[test]
fn lanes_have_the_bits_of_systems_alone() {
    let rng = &mut ChaCha8Rng::seed_from_u64(11);
    let (mut mended, mut failed) = (0.0, 0);
    for trial in 0..100 {
        let (topology, first) = equations(rng, trial % 2, 0.5);
        let systems: [Equations; 4] = std::array::from_fn(|lane| {
            let mut own = first.clone();
            for body in own.bodies.iter_mut().filter(|body| !body.is_held()) {
                body.turning = positive(rng, 0.1) + Sym3::identity(if lane == 1 { -0.3 } else { 0.0 });
                body.defect = random_pair(rng);
            }
            if lane == 3 && trial % 3 == 0 {
                own.bodies.iter_mut().for_each(|body| body.defect.linear.0[0] = f64::NAN);
                own.bodies[0].turning.0[0] = f64::NAN;
            }
            own
        });
        let lanes = |of: &dyn Fn(&Equations) -> f64| {
            let mut out = Lanes::<4>::zero();
            systems.iter().enumerate().for_each(|(lane, system)| out.set_lane(lane, of(system)));
            out
        };
        let spatial = |of: &dyn Fn(&Equations) -> Spatial<f64>| {
            Spatial::from_array(std::array::from_fn(|k| lanes(&|system| of(system).to_array()[k])))
        };
        let sym =
            |of: &dyn Fn(&Equations) -> Sym3<f64>| Sym3(std::array::from_fn(|k| lanes(&|system| of(system).0[k])));
        let vec =
            |of: &dyn Fn(&Equations) -> Vec3<f64>| Vec3(std::array::from_fn(|k| lanes(&|system| of(system).0[k])));
        let side_by_side = Equations {
            bodies: (0..first.bodies.len())
                .map(|i| BodyEquation {
                    mass: lanes(&|system| system.bodies[i].mass),
                    turning: sym(&|system| system.bodies[i].turning),
                    defect: spatial(&|system| system.bodies[i].defect),
                })
                .collect(),
            joints: (0..first.joints.len())
                .map(|j| JointEquation {
                    length: lanes(&|system| system.joints[j].length),
                    arms: [0, 1].map(|end| vec(&|system| system.joints[j].arms[end])),
                    compliance: [0, 1].map(|part| sym(&|system| system.joints[j].compliance[part])),
                    coupling: Coupling {
                        symmetric: sym(&|system| system.joints[j].coupling.symmetric),
                        half_torque: vec(&|system| system.joints[j].coupling.half_torque),
                    },
                    rhs: spatial(&|system| system.joints[j].rhs),
                })
                .collect(),
            ..Equations::default()
        };
        let mut together = Elimination::<Lanes<4>>::new(&topology).unwrap();
        let solved = together.solve_lanes(&side_by_side);
        for (lane, system) in systems.iter().enumerate() {
            let mut alone = Elimination::new(&topology).unwrap();
            let is_solved = alone.solve(system);
            assert_eq!(solved.lane(lane) >= 0.0, is_solved, "trial {trial}, lane {lane}");
            failed += usize::from(!is_solved);
            if !is_solved {
                continue;
            }
            mended += alone.mended;
            assert_eq!(together.mended.lane(lane), alone.mended);
            let pairs = together.corrections.iter().zip(&alone.corrections);
            for (own, expected) in pairs.chain(together.multipliers.iter().zip(&alone.multipliers)) {
                let own = own.to_array().map(|x| x.lane(lane).to_bits());
                assert_eq!(own, expected.to_array().map(f64::to_bits), "trial {trial}, lane {lane}");
            }
        }
    }
    assert!(mended > 10.0 && failed > 10, "{mended} {failed}");
}

/// A root of columns is that of their sum, and keeps small compliances beside one that is larger by any factor: with the large one
/// infinite, what is left is that of the two others across it.
#[test]
fn roots_of_columns_lose_nothing_beside_a_large_compliance() {
    let rng = &mut ChaCha8Rng::seed_from_u64(17);
    let product = |root: &crate::tangent::Root<f64>| {
        let columns = [0, 1, 2].map(|k| {
            let unit = [0, 1, 2].map(|i| f64::from(u8::from(i == k)) * root.diagonal[k]);
            nalgebra::Vector3::from(root.apply(unit).0)
        });
        let l =
            [0, 1, 2].map(|k| nalgebra::Vector3::from(root.apply([0, 1, 2].map(|i| f64::from(u8::from(i == k)))).0));
        columns.iter().zip(&l).map(|(a, b)| a * b.transpose()).sum::<nalgebra::Matrix3<f64>>()
    };
    for large in [1.0, 1e6, 1e12, 1e18, 1e24] {
        for _ in 0..20 {
            let v = [random(rng), random(rng), random(rng)].map(|x| nalgebra::Vector3::from(x.0));
            if nalgebra::Matrix3::from_columns(&v).determinant().abs() < 0.1 {
                continue;
            }
            let c = [rng.random_range(0.5..2.0), rng.random_range(0.5..2.0), large];
            let root = crate::tangent::Root::of_columns(c, v.map(|x| Vec3(x.into())));
            let sum = (0..3).map(|i| v[i] * v[i].transpose() * c[i]).sum::<nalgebra::Matrix3<f64>>();
            assert!((product(&root) - sum).norm() < 1e-13 * sum.norm(), "{large:e}");
            // In the two directions across the large column, by the inverse: V^-T c^-1 V^-1.
            let inverse = nalgebra::Matrix3::from_columns(&v).try_inverse().unwrap();
            let expected = inverse.transpose() * nalgebra::Matrix3::from_diagonal(&c.map(f64::recip).into()) * inverse;
            let (found, exists) = root.inverse(0.0);
            let error = (matrix(found.full()) - expected).norm() / expected.norm();
            assert!(exists >= 0.0 && error < 1e-9, "{large:e}: {error:e}");
        }
    }
}
