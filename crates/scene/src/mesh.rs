//! Files of triangles: Wavefront OBJ and STL, with text or binary.

use nalgebra::Vector3;
use rod::{Mesh, MeshError};
use toml::Spanned;

use crate::columns::{bytes, place};
use crate::error::{Mistake, Result, Source, mistaken};
use crate::shape::NODE_DISTANCE;

/// Bytes before the triangles of a binary STL file, and of each triangle.
const STL_HEAD: usize = 84;
const STL_TRIANGLE: usize = 50;

/// Corners and triangles as they stand in a file, and the lines of them.
#[derive(Default)]
struct Parts {
    places: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
    lines: Vec<usize>,
    /// The line of each corner; empty of a binary file.
    corner_lines: Vec<usize>,
}

/// Reads the file that a scene names, from the scene's own folder on, its lengths times `scale`.
pub(crate) fn read(source: &Source, name: &Spanned<String>, scale: f64) -> Result<Mesh> {
    let (path, file) = place(source, name, "a file of triangles (.obj or .stl)")?;
    let kind = path.extension().map(|kind| kind.to_string_lossy().to_lowercase());
    let bytes = || bytes(&path, &file);
    let parts = match kind.as_deref() {
        Some("obj") => obj(&String::from_utf8_lossy(&bytes()?)),
        Some("stl") => stl(&bytes()?),
        _ => return source.must_be(name.span(), "a file of triangles, its name ending in .obj or .stl"),
    };
    let read = parts.and_then(|parts| mesh(parts, scale)).map_err(|mistake| mistaken(&file, mistake));
    source.of_file(name.span(), read)
}

fn mesh(parts: Parts, scale: f64) -> std::result::Result<Mesh, Mistake> {
    let Parts { mut places, triangles, lines, corner_lines } = parts;
    places.iter_mut().for_each(|place| *place *= scale);
    let is_far = |place: &Vector3<f64>| place.iter().any(|x| x.abs() > NODE_DISTANCE.end);
    if let Some(k) = places.iter().position(is_far) {
        let line = corner_lines.get(k).copied().unwrap_or(1);
        let far = places[k].amax();
        let message =
            format!("a corner with {far:e} m, times `scale`, but it must be {:e} m at most", NODE_DISTANCE.end);
        return Err((line, message));
    }
    let line_of = |triangle: usize| lines.get(triangle).copied().unwrap_or(1);
    Mesh::new(places, triangles).map_err(|error| match error {
        MeshError::NoVertex { triangle, vertex, count } => {
            (line_of(triangle), format!("a triangle has corner {}, but there are {count}", u64::from(vertex) + 1))
        }
        MeshError::NotFinite(_) => (1, "all corners must be finite, times `scale` too".to_owned()),
        MeshError::Empty => (1, "there must be at least one triangle with an area".to_owned()),
    })
}

/// Lines `v x y z` and `f a b c ...` of an OBJ file; faces of more corners are fans of triangles, all other lines count for nothing.
fn obj(text: &str) -> std::result::Result<Parts, Mistake> {
    let mut parts = Parts::default();
    for (number, line) in (1..).zip(text.lines()) {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                parts.places.push(vector(&mut words, number, "v")?);
                parts.corner_lines.push(number);
            }
            Some("f") => {
                let count = parts.places.len();
                let corners: Vec<u32> =
                    words.map(|word| corner(word, count, number)).collect::<std::result::Result<_, _>>()?;
                if corners.len() < 3 {
                    return Err((number, format!("a face of {} corners, but there must be at least 3", corners.len())));
                }
                for pair in corners[1..].windows(2) {
                    parts.triangles.push([corners[0], pair[0], pair[1]]);
                    parts.lines.push(number);
                }
            }
            _ => {}
        }
    }
    Ok(parts)
}

/// The index in `a`, `a/b`, `a//c` or `a/b/c`: from 1, or from -1 backwards over the `count` corners so far.
fn corner(word: &str, count: usize, line: usize) -> std::result::Result<u32, Mistake> {
    let index = word.split('/').next().and_then(|index| index.parse::<i64>().ok());
    let found = match index {
        Some(index @ 1..) => u32::try_from(index - 1).ok(),
        Some(index @ ..=-1) => index.checked_add(count as i64).and_then(|index| u32::try_from(index).ok()),
        _ => None,
    };
    found.ok_or_else(|| {
        let allowed = "a corner's number from 1, or from -1 backwards over those before this line";
        (line, format!("f {word:.40}, but it must be {allowed} (there are {count})"))
    })
}

fn vector<'a>(
    words: &mut impl Iterator<Item = &'a str>,
    line: usize,
    what: &str,
) -> std::result::Result<Vector3<f64>, Mistake> {
    let mut place = Vector3::zeros();
    for x in place.iter_mut() {
        let word = words.next().unwrap_or_default();
        *x = match word.parse::<f64>() {
            Ok(value) if value.is_finite() => value,
            _ => return Err((line, format!("{what} {word:.40}, but there must be three finite numbers"))),
        };
    }
    Ok(place)
}

/// An STL file: binary where its length is that of the triangles it says it has, else text.
fn stl(bytes: &[u8]) -> std::result::Result<Parts, Mistake> {
    let count =
        bytes.get(80..STL_HEAD).map_or(0, |count| count.iter().rev().fold(0, |n, &byte| n << 8 | usize::from(byte)));
    if bytes.len() >= STL_HEAD && bytes.len() - STL_HEAD == STL_TRIANGLE * count {
        return Ok(binary(&bytes[STL_HEAD..]));
    }
    let mut parts = Parts::default();
    let text = String::from_utf8_lossy(bytes);
    let (mut corners, mut is_whole) = (0, false);
    for (number, line) in (1..).zip(text.lines()) {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("vertex") => {
                parts.places.push(vector(&mut words, number, "vertex")?);
                parts.corner_lines.push(number);
                corners += 1;
            }
            Some("endfacet") => {
                if corners != 3 {
                    return Err((number, format!("a facet of {corners} corners, but there must be 3")));
                }
                let first = parts.places.len() as u32 - 3;
                parts.triangles.push([first, first + 1, first + 2]);
                parts.lines.push(number);
                corners = 0;
            }
            Some("endsolid") => is_whole = true,
            _ => {}
        }
    }
    if parts.triangles.is_empty() {
        return Err((1, "this is no STL file: neither facets in words, nor as many as bytes 80 to 84 say".to_owned()));
    }
    if corners != 0 || !is_whole {
        return Err((text.lines().count(), "the file ends before its last facet, or without `endsolid`".to_owned()));
    }
    Ok(parts)
}

fn binary(bytes: &[u8]) -> Parts {
    let mut parts = Parts::default();
    for triangle in bytes.chunks_exact(STL_TRIANGLE) {
        let first = parts.places.len() as u32;
        for corner in triangle[12..48].chunks_exact(12) {
            let number = |k: usize| f64::from(f32::from_le_bytes(std::array::from_fn(|i| corner[4 * k + i])));
            parts.places.push(Vector3::new(number(0), number(1), number(2)));
        }
        parts.triangles.push([first, first + 1, first + 2]);
    }
    parts
}
