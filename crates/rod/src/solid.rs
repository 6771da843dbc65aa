//! Surfaces of triangles as rigid bodies: volume, centre of mass and principal axes.
//!
//! A closed surface is the sum of the tetrahedra between its triangles and any one point, with signs; integrals of
//! polynomials over them have closed forms (Mirtich 1996, "Fast and Accurate Computation of Polyhedral Mass Properties";
//! Eberly 2002, "Polyhedral Mass Properties (Revisited)").

use std::collections::HashMap;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use thiserror::Error;

use crate::{Mesh, MeshError, Pose};

/// Off-diagonal second moments below this share of their trace are rounding: the given axes are the principal ones.
const PRINCIPAL: f64 = 1e-12;

/// A surface of triangles as the shape of a rigid body, in the body's frame: its origin is the centre of mass.
#[derive(Clone, Debug, PartialEq)]
pub struct SolidMesh {
    mesh: Mesh,
    axes: Pose,
    volume: f64,
    inertia_per_mass: Vector3<f64>,
}

/// Why triangles are no full body.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SolidError {
    /// They are no surface.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The surface has a border.
    #[error("the surface is open: {0} of its edges have no triangle on their other side")]
    Open(usize),
    /// Its triangles turn the wrong way: what it encloses [m^3] is < 0.
    #[error(
        "the surface is inside out: it encloses {0} m^3; its triangles must be counterclockwise as seen from outside"
    )]
    InsideOut(f64),
    /// What it encloses [m^3] is nothing that a body can be made of.
    #[error("the surface encloses {0} m^3, but that must be finite and > 0")]
    NoVolume(f64),
}

impl SolidMesh {
    /// The body that fills a closed surface, convex or not, evenly. Its frame is along the principal axes: those that are
    /// nearest to the axes of `mesh`, which are the same where they are principal.
    ///
    /// # Errors
    /// [`SolidError`] where the mesh is no surface, is open or inside out, or encloses no volume.
    pub fn full(mesh: Mesh) -> Result<Self, SolidError> {
        let mesh = Mesh::new(mesh.positions, mesh.triangles)?;
        let open = open_edges(&mesh);
        if open > 0 {
            return Err(SolidError::Open(open));
        }
        let Moments { volume, centre, second } = Moments::of(&mesh);
        if volume.is_finite() && volume < 0.0 {
            return Err(SolidError::InsideOut(volume));
        }
        if !(volume > 0.0 && second.iter().chain(&centre).all(|x| x.is_finite())) {
            return Err(SolidError::NoVolume(volume));
        }
        let (moments, turn) = principal(&second);
        if moments.min() <= 0.0 {
            return Err(SolidError::NoVolume(volume));
        }
        let inertia_per_mass = moments.map(|own| moments.sum() - own);
        Ok(Self { inertia_per_mass, ..Self::placed(mesh, volume, centre, turn) })
    }

    /// A surface, closed or open, on a body whose centre of mass is at `centre` [m] in the axes of `mesh`, which are the
    /// body's. It has no inertia of its own; its volume is what it encloses, 0 where it is open.
    ///
    /// # Errors
    /// [`SolidError::Mesh`] where the mesh is no surface.
    pub fn about(mesh: Mesh, centre: Vector3<f64>) -> Result<Self, SolidError> {
        let mesh = Mesh::new(mesh.positions, mesh.triangles)?;
        let enclosed = if open_edges(&mesh) == 0 { Moments::of(&mesh).volume } else { 0.0 };
        let volume = if enclosed.is_finite() { enclosed.max(0.0) } else { 0.0 };
        Ok(Self::placed(mesh, volume, centre, UnitQuaternion::identity()))
    }

    /// The surface in the frame of a body at `centre`, turned by `turn`, in its axes.
    fn placed(mut mesh: Mesh, volume: f64, centre: Vector3<f64>, turn: UnitQuaternion<f64>) -> Self {
        let back = turn.inverse();
        mesh.positions.iter_mut().for_each(|place| *place = back * (*place - centre));
        mesh.normals.iter_mut().for_each(|normal| *normal = back * *normal);
        let axes = Pose { position: back * -centre, orientation: back };
        Self { mesh, axes, volume, inertia_per_mass: Vector3::zeros() }
    }

    /// The surface in the body's frame.
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// Where the axes in which the surface was given are, in the body's frame.
    pub fn axes(&self) -> Pose {
        self.axes
    }

    /// The centre of mass in those axes [m].
    pub fn centre(&self) -> Vector3<f64> {
        self.axes.orientation.inverse() * -self.axes.position
    }

    /// A place in those axes [m] in the body's frame [m].
    pub fn place(&self, place: &Vector3<f64>) -> Vector3<f64> {
        self.axes.position + self.axes.orientation * place
    }

    /// The body's pose where those axes are at `axes` in the world.
    pub fn pose(&self, axes: &Pose) -> Pose {
        let orientation = axes.orientation * self.axes.orientation.inverse();
        Pose { position: axes.position - orientation * self.axes.position, orientation }
    }

    /// Volume inside [m^3]; 0 of an open surface.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Moments of inertia about the body's axes of 1 kg that fills it evenly [m^2]; 0 of [`SolidMesh::about`].
    pub fn inertia_per_mass(&self) -> Vector3<f64> {
        self.inertia_per_mass
    }

    /// Area of the surface [m^2].
    pub fn area(&self) -> f64 {
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|i| self.mesh.positions[i as usize]);
            0.5 * (b - a).cross(&(c - a)).norm()
        };
        self.mesh.triangles.iter().map(area).sum()
    }

    /// Extent along the body's z axis and largest distance from that axis [m], neither less than a thousandth of the other.
    pub(crate) fn extents(&self) -> (f64, f64) {
        let places = || self.mesh.triangles.iter().flatten().map(|&i| self.mesh.positions[i as usize]);
        let (low, high) =
            places().fold((f64::INFINITY, -f64::INFINITY), |(low, high), p| (low.min(p.z), high.max(p.z)));
        let radius = places().map(|place| place.xy().norm()).fold(0.0, f64::max);
        let least = 1e-3 * radius.max(high - low);
        ((high - low).max(least), radius.max(least))
    }
}

/// Edges that are not passed as often in one direction as in the other. Vertices at the same place are one.
fn open_edges(mesh: &Mesh) -> usize {
    let mut known = HashMap::new();
    // 0 and -0 are the same place.
    let bits = |place: &Vector3<f64>| [place.x, place.y, place.z].map(|x| (x + 0.0).to_bits());
    let same: Vec<usize> =
        mesh.positions.iter().enumerate().map(|(i, place)| *known.entry(bits(place)).or_insert(i)).collect();
    let mut passed: HashMap<[usize; 2], i64> = HashMap::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|i| same[i as usize]);
        for [from, to] in [[a, b], [b, c], [c, a]] {
            *passed.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
        }
    }
    passed.values().filter(|&&count| count != 0).count()
}

/// Integrals over what a closed surface encloses.
struct Moments {
    /// [m^3]
    volume: f64,
    /// Centroid [m].
    centre: Vector3<f64>,
    /// Second moments about the centroid over the volume, the integral of x x^T [m^2].
    second: Matrix3<f64>,
}

impl Moments {
    fn of(mesh: &Mesh) -> Self {
        // Tetrahedra from the middle of the box about it: from far away they would cancel.
        let places = || mesh.triangles.iter().flatten().map(|&i| mesh.positions[i as usize]);
        let infinite = Vector3::repeat(f64::INFINITY);
        let (low, high) = places().fold((infinite, -infinite), |(low, high), p| (low.inf(&p), high.sup(&p)));
        let middle = low * 0.5 + high * 0.5;
        let (mut six_volumes, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|i| mesh.positions[i as usize] - middle);
            let six = a.dot(&b.cross(&c));
            let sum = a + b + c;
            six_volumes += six;
            first += sum * six;
            second += (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose()) * six;
        }
        let centre = first / (4.0 * six_volumes);
        let second = second / (20.0 * six_volumes) - centre * centre.transpose();
        Self { volume: six_volumes / 6.0, centre: middle + centre, second }
    }
}

/// Principal moments of a symmetric tensor and the turn from its axes to the principal ones, the least that there is.
fn principal(tensor: &Matrix3<f64>) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let off = tensor.m12.abs().max(tensor.m13.abs()).max(tensor.m23.abs());
    if off <= PRINCIPAL * tensor.trace() {
        return (tensor.diagonal(), UnitQuaternion::identity());
    }
    let eigen = tensor.symmetric_eigen();
    let along = |order: &[usize; 3]| (0..3).map(|k| eigen.eigenvectors[(k, order[k])].abs()).sum::<f64>();
    let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let order = orders.into_iter().fold(orders[0], |best, own| if along(&own) > along(&best) { own } else { best });
    let axis = |k: usize| {
        let axis = eigen.eigenvectors.column(order[k]).into_owned();
        if axis[k] < 0.0 { -axis } else { axis }
    };
    let mut axes = [axis(0), axis(1), axis(2)];
    if axes[0].cross(&axes[1]).dot(&axes[2]) < 0.0 {
        // The one whose sign says least.
        let least = if axes[0][0] < axes[1][1] { 0 } else { 1 };
        let least = if axes[2][2] < axes[least][least] { 2 } else { least };
        axes[least] = -axes[least];
    }
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(Matrix3::from_columns(&axes)));
    (Vector3::from_fn(|k, _| eigen.eigenvalues[order[k]]), turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BodyShape;

    /// A mesh at another place.
    fn moved(mesh: &Mesh, by: Vector3<f64>, turn: UnitQuaternion<f64>) -> Mesh {
        let positions = mesh.positions.iter().map(|place| turn * place + by).collect();
        Mesh::new(positions, mesh.triangles.clone()).unwrap()
    }

    #[test]
    fn a_box_of_triangles_has_the_mass_properties_of_a_box() {
        let sides = Vector3::new(0.2, 0.5, 1.1);
        let block = BodyShape::Box { sides };
        let solid = SolidMesh::full(block.mesh()).unwrap();
        assert!((solid.volume() / block.volume() - 1.0).abs() < 1e-12);
        assert!((solid.inertia_per_mass() - block.inertia_per_mass()).norm() < 1e-12);
        assert_eq!(solid.axes().orientation, UnitQuaternion::identity(), "its axes are principal");
        assert!((solid.area() - 4.0 * BodyShape::drag_area(&block)).abs() < 1e-12);
        // Wherever the file has it, the body is the same one.
        let turn = UnitQuaternion::from_euler_angles(0.2, -0.3, 0.25);
        let shift = Vector3::new(0.7, -0.4, 1.3);
        let solid = SolidMesh::full(moved(&block.mesh(), shift, turn)).unwrap();
        assert!((solid.inertia_per_mass() - block.inertia_per_mass()).norm() < 1e-12);
        let still = Pose { position: Vector3::zeros(), orientation: UnitQuaternion::identity() };
        let pose = solid.pose(&still);
        assert!((pose.position - shift).norm() < 1e-12 && pose.orientation.angle_to(&turn) < 1e-7);
        for (own, file) in solid.mesh().positions.iter().zip(&block.mesh().positions) {
            let place = turn * file + shift;
            assert!((pose.position + pose.orientation * own - place).norm() < 1e-12);
            assert!((solid.place(&place) - own).norm() < 1e-12);
        }
    }

    #[test]
    fn a_tetrahedron_has_the_closed_form() {
        // With its right corner at the origin and legs a along the axes: V = a^3 / 6, centre a / 4, and about the centre
        // second moments 3 a^2 / 80 on the diagonal and -a^2 / 80 beside it.
        let a = 1.5;
        let positions = vec![Vector3::zeros(), Vector3::x() * a, Vector3::y() * a, Vector3::z() * a];
        let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let mesh = Mesh::new(positions, triangles).unwrap();
        let Moments { volume, centre, second } = Moments::of(&mesh);
        assert!((volume - a.powi(3) / 6.0).abs() < 1e-12);
        assert!((centre - Vector3::repeat(a / 4.0)).norm() < 1e-12);
        let exact = Matrix3::from_fn(|i, j| if i == j { 3.0 } else { -1.0 }) * (a * a / 80.0);
        assert!((second - exact).norm() < 1e-12, "{second}");
        // Its eigenvalues are a^2 / 80 along the diagonal of the axes and 4 a^2 / 80 across it.
        let mut moments = SolidMesh::full(mesh).unwrap().inertia_per_mass();
        moments.as_mut_slice().sort_by(f64::total_cmp);
        assert!((moments - Vector3::new(5.0, 5.0, 8.0) * (a * a / 80.0)).norm() < 1e-12, "{moments}");
    }

    #[test]
    fn what_is_no_body_is_refused() {
        let Mesh { positions, triangles, .. } = BodyShape::Box { sides: Vector3::repeat(1.0) }.mesh();
        let open = Mesh::new(positions.clone(), triangles[1..].to_vec()).unwrap();
        assert_eq!(SolidMesh::full(open.clone()), Err(SolidError::Open(3)));
        assert_eq!(SolidMesh::about(open, Vector3::zeros()).unwrap().volume(), 0.0);
        let inwards = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let inwards = Mesh::new(positions, inwards).unwrap();
        assert!(matches!(SolidMesh::full(inwards), Err(SolidError::InsideOut(volume)) if volume < 0.0));
        // Two sides of one triangle.
        let flat = Mesh::new(vec![Vector3::zeros(), Vector3::x(), Vector3::y()], vec![[0, 1, 2], [0, 2, 1]]).unwrap();
        assert!(matches!(SolidMesh::full(flat), Err(SolidError::NoVolume(_))));
        let broken = Mesh { positions: vec![Vector3::repeat(f64::NAN)], ..Mesh::default() };
        assert_eq!(SolidMesh::full(broken), Err(SolidError::Mesh(MeshError::NotFinite(0))));
    }
}
