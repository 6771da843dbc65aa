//! Grids of numbers, as files hold them.

/// Numbers in a grid of any dimension, the last axis changing fastest.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Grid {
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<f64>,
}

impl Grid {
    /// A grid of this shape.
    ///
    /// # Errors
    /// If it has another number of values.
    pub(super) fn new(shape: Vec<usize>, values: Vec<f64>) -> Result<Self, String> {
        if shape.iter().try_fold(1usize, |all, &size| all.checked_mul(size)) == Some(values.len()) {
            return Ok(Self { shape, values });
        }
        Err(format!("an array of the shape {shape:?} with {} numbers", values.len()))
    }

    /// Notes that the lists at this depth have `size` entries.
    ///
    /// # Errors
    /// If others there have another number, or none of them are lists.
    pub(super) fn expect(&mut self, depth: usize, size: usize) -> Result<(), String> {
        match self.shape.get(depth) {
            Some(&known) if known == size => Ok(()),
            Some(known) => Err(format!("lists of different lengths: {known} and {size}")),
            None if !self.values.is_empty() => Err("lists of different depths".to_owned()),
            None => {
                self.shape.push(size);
                Ok(())
            }
        }
    }

    /// The grid whose values lie as these do if the first axis changes fastest.
    pub(super) fn first_axis_fastest(&self) -> Self {
        let mut place = vec![0; self.shape.len()];
        let mut next = || {
            let index = self.shape.iter().zip(&place).rev().fold(0, |index, (size, at)| index * size + at);
            for axis in (0..place.len()).rev() {
                place[axis] += 1;
                if place[axis] < self.shape[axis] {
                    break;
                }
                place[axis] = 0;
            }
            self.values[index]
        };
        Self { shape: self.shape.clone(), values: (0..self.values.len()).map(|_| next()).collect() }
    }
}

/// The numbers of an array's bytes, by the name of numpy's type, the most significant byte first where `big`.
///
/// # Errors
/// If the type is unknown, or there is a part of a number.
pub(super) fn elements(name: &str, big: bool, bytes: &[u8]) -> Result<Vec<f64>, String> {
    match name {
        "f8" => numbers(bytes, big, f64::from_le_bytes),
        "f4" => numbers(bytes, big, |array| f64::from(f32::from_le_bytes(array))),
        "i4" => numbers(bytes, big, |array| f64::from(i32::from_le_bytes(array))),
        "i8" => numbers(bytes, big, |array| i64::from_le_bytes(array) as f64),
        _ => Err(format!("elements of the type {name:?}; f8, f4, i8 and i4 are known")),
    }
}

fn numbers<const N: usize>(bytes: &[u8], big: bool, number: impl Fn([u8; N]) -> f64) -> Result<Vec<f64>, String> {
    let (chunks, rest) = bytes.as_chunks::<N>();
    if !rest.is_empty() {
        return Err(format!("{} bytes are no whole number of {N} bytes", bytes.len()));
    }
    let one = |mut array: [u8; N]| {
        if big {
            array.reverse();
        }
        number(array)
    };
    Ok(chunks.iter().copied().map(one).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_axis_may_change_fastest() {
        let grid = Grid::new(vec![2, 3], vec![1.0, 4.0, 2.0, 5.0, 3.0, 6.0]).unwrap();
        assert_eq!(grid.first_axis_fastest().values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    }
}
