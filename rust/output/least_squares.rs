//! Small dense linear least squares: a Cholesky factor of the normal equations that grows column by column.

use crate::real::Scalar;

/// A column whose part outside the earlier ones is smaller than this (squared, relative) is not determined.
const DEPENDENT: f64 = 1e-13;

/// Columns and data of one problem.
pub struct LeastSquares<'a, S> {
    data: &'a [S],
    columns: Vec<Vec<S>>,
    lengths: Vec<S>,
    /// Rows of the lower factor; each row ends with its diagonal element.
    factor: Vec<Vec<S>>,
    /// The data in the coordinates of the factor.
    reduced: Vec<S>,
}

impl<'a, S: Scalar> LeastSquares<'a, S> {
    /// A problem without columns.
    pub fn new(data: &'a [S]) -> Self {
        Self { data, columns: Vec::new(), lengths: Vec::new(), factor: Vec::new(), reduced: Vec::new() }
    }

    /// How many columns there are.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Forgets all columns but the first ones.
    pub fn truncate(&mut self, len: usize) {
        self.columns.truncate(len);
        self.lengths.truncate(len);
        self.factor.truncate(len);
        self.reduced.truncate(len);
    }

    /// Adds a column; None where the earlier ones already span it.
    pub fn push(&mut self, column: Vec<S>) -> Option<()> {
        let length = dot(&column, &column).sqrt();
        let mut row = Vec::with_capacity(self.len() + 1);
        let mut left = S::splat(1.0);
        for (index, (earlier, &scale)) in self.columns.iter().zip(&self.lengths).enumerate() {
            let value = dot(&column, earlier) / (length * scale) - dot(&row, &self.factor[index][..index]);
            let value = value / self.factor[index][index];
            left = left - value * value;
            row.push(value);
        }
        if left.plain().is_nan() || left.plain() < DEPENDENT || self.len() >= self.data.len() {
            return None;
        }
        let diagonal = left.sqrt();
        self.reduced.push((dot(&column, self.data) / length - dot(&row, &self.reduced)) / diagonal);
        row.push(diagonal);
        self.factor.push(row);
        self.lengths.push(length);
        self.columns.push(column);
        Some(())
    }

    /// The coefficients of the columns.
    pub fn solve(&self) -> Vec<S> {
        let mut solution = self.reduced.clone();
        for row in (0..self.len()).rev() {
            for below in row + 1..self.len() {
                solution[row] = solution[row] - self.factor[below][row] * solution[below];
            }
            solution[row] = solution[row] / self.factor[row][row];
        }
        solution.iter_mut().zip(&self.lengths).for_each(|(x, length)| *x = *x / *length);
        solution
    }
}

/// Scalar product, summed in four strands.
fn dot<S: Scalar>(left: &[S], right: &[S]) -> S {
    let (left_chunks, right_chunks) = (left.chunks_exact(4), right.chunks_exact(4));
    let rest =
        left_chunks.remainder().iter().zip(right_chunks.remainder()).fold(S::zero(), |sum, (x, y)| sum + *x * *y);
    let mut sums = [S::zero(); 4];
    for (x, y) in left_chunks.zip(right_chunks) {
        for strand in 0..4 {
            sums[strand] = sums[strand] + x[strand] * y[strand];
        }
    }
    sums[0] + sums[1] + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::LeastSquares;

    #[test]
    fn exact_line() {
        let x: Vec<f64> = (0..21).map(f64::from).collect();
        let y: Vec<f64> = x.iter().map(|x| 3.0 - 0.5 * x).collect();
        let mut problem = LeastSquares::new(&y);
        assert!(problem.push(vec![1.0; 21]).is_some() && problem.push(x).is_some());
        let found = problem.solve();
        assert!((found[0] - 3.0).abs() < 1e-12 && (found[1] + 0.5).abs() < 1e-13);
    }

    #[test]
    fn exact_refusal_of_dependent_columns() {
        let mut problem = LeastSquares::new(&[1.0; 5]);
        assert!(problem.push(vec![1.0; 5]).is_some());
        assert!(problem.push(vec![2.0; 5]).is_none());
    }
}
