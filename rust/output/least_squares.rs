//! Small dense linear least squares: a Cholesky factor of the normal equations that grows column by column.

/// A column whose part outside the earlier ones is smaller than this (squared, relative) is not determined.
const DEPENDENT: f64 = 1e-13;

/// Columns and data of one problem.
pub struct LeastSquares<'a> {
    data: &'a [f64],
    columns: Vec<Vec<f64>>,
    lengths: Vec<f64>,
    /// Rows of the lower factor; each row ends with its diagonal element.
    factor: Vec<Vec<f64>>,
    /// The data in the coordinates of the factor.
    reduced: Vec<f64>,
}

impl<'a> LeastSquares<'a> {
    /// A problem without columns.
    pub fn new(data: &'a [f64]) -> Self {
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
    pub fn push(&mut self, column: Vec<f64>) -> Option<()> {
        let length = dot(&column, &column).sqrt();
        let mut row = Vec::with_capacity(self.len() + 1);
        let mut left = 1.0;
        for (index, (earlier, &scale)) in self.columns.iter().zip(&self.lengths).enumerate() {
            let value = dot(&column, earlier) / (length * scale) - dot(&row, &self.factor[index][..index]);
            let value = value / self.factor[index][index];
            left -= value * value;
            row.push(value);
        }
        if left.is_nan() || left < DEPENDENT || self.len() >= self.data.len() {
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

    /// The columns.
    pub fn columns(&self) -> &[Vec<f64>] {
        &self.columns
    }

    /// The coefficients of the columns.
    pub fn solve(&self) -> Vec<f64> {
        self.descend(self.reduced.clone())
    }

    /// Sum of the squares of what the columns leave of the data.
    pub fn unexplained(&self) -> f64 {
        (dot(self.data, self.data) - dot(&self.reduced, &self.reduced)).max(0.0)
    }

    /// The solution of the normal equations with another right-hand side.
    pub fn solve_for(&self, products: &[f64]) -> Vec<f64> {
        let mut reduced = Vec::with_capacity(self.len());
        for ((row, product), length) in self.factor.iter().zip(products).zip(&self.lengths) {
            let known = dot(&row[..reduced.len()], &reduced);
            reduced.push((product / length - known) / row[reduced.len()]);
        }
        self.descend(reduced)
    }

    /// From the coordinates of the factor to coefficients.
    fn descend(&self, mut solution: Vec<f64>) -> Vec<f64> {
        for row in (0..self.len()).rev() {
            for below in row + 1..self.len() {
                solution[row] -= self.factor[below][row] * solution[below];
            }
            solution[row] /= self.factor[row][row];
        }
        solution.iter_mut().zip(&self.lengths).for_each(|(x, length)| *x /= length);
        solution
    }
}

/// Scalar product, summed in four strands.
pub fn dot(left: &[f64], right: &[f64]) -> f64 {
    let (left_chunks, right_chunks) = (left.chunks_exact(4), right.chunks_exact(4));
    let rest = left_chunks.remainder().iter().zip(right_chunks.remainder()).fold(0.0, |sum, (x, y)| sum + x * y);
    let mut sums = [0.0; 4];
    for (x, y) in left_chunks.zip(right_chunks) {
        for strand in 0..4 {
            sums[strand] += x[strand] * y[strand];
        }
    }
    sums[0] + sums[1] + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::{LeastSquares, dot};

    #[test]
    fn exact_line() {
        let x: Vec<f64> = (0..21).map(f64::from).collect();
        let y: Vec<f64> = x.iter().map(|x| 3.0 - 0.5 * x).collect();
        let mut problem = LeastSquares::new(&y);
        assert!(problem.push(vec![1.0; 21]).is_some() && problem.push(x).is_some());
        let found = problem.solve();
        assert!((found[0] - 3.0).abs() < 1e-12 && (found[1] + 0.5).abs() < 1e-13);
        assert!(problem.unexplained() < 1e-12 * dot(&y, &y));
        let products: Vec<f64> = problem.columns().iter().map(|column| dot(column, &y)).collect();
        let again = problem.solve_for(&products);
        assert!((found[0] - again[0]).abs() < 1e-12 && (found[1] - again[1]).abs() < 1e-13);
    }

    #[test]
    fn exact_refusal_of_dependent_columns() {
        let mut problem = LeastSquares::new(&[1.0; 5]);
        assert!(problem.push(vec![1.0; 5]).is_some());
        assert!(problem.push(vec![2.0; 5]).is_none());
    }
}
