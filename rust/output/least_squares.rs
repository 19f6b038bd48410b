//! Small dense linear least squares by the normal equations, columns scaled to unit length.

/// The coefficients of `columns` (each as long as `data`) that fit `data` best; None where they are not determined.
pub fn fit(columns: &[Vec<f64>], data: &[f64]) -> Option<Vec<f64>> {
    let n = columns.len();
    if data.len() < n {
        return None;
    }
    let dot = |left: &[f64], right: &[f64]| left.iter().zip(right).map(|(x, y)| x * y).sum::<f64>();
    let lengths: Vec<f64> = columns.iter().map(|column| dot(column, column).sqrt()).collect();
    let mut lower = vec![vec![0.0; n]; n];
    for row in 0..n {
        for column in 0..=row {
            let mut value = dot(&columns[row], &columns[column]) / (lengths[row] * lengths[column]);
            for k in 0..column {
                value -= lower[row][k] * lower[column][k];
            }
            if row > column {
                lower[row][column] = value / lower[column][column];
            } else if value > 1e-13 {
                lower[row][row] = value.sqrt();
            } else {
                return None;
            }
        }
    }
    let mut solution: Vec<f64> = (0..n).map(|row| dot(&columns[row], data) / lengths[row]).collect();
    for row in 0..n {
        for k in 0..row {
            solution[row] -= lower[row][k] * solution[k];
        }
        solution[row] /= lower[row][row];
    }
    for row in (0..n).rev() {
        for k in row + 1..n {
            solution[row] -= lower[k][row] * solution[k];
        }
        solution[row] /= lower[row][row];
    }
    solution.iter_mut().zip(&lengths).for_each(|(x, length)| *x /= length);
    Some(solution)
}

#[cfg(test)]
mod tests {
    use super::fit;

    #[test]
    fn exact_line() {
        let x: Vec<f64> = (0..20).map(f64::from).collect();
        let y: Vec<f64> = x.iter().map(|x| 3.0 - 0.5 * x).collect();
        let found = fit(&[vec![1.0; 20], x], &y).expect("two columns");
        assert!((found[0] - 3.0).abs() < 1e-12 && (found[1] + 0.5).abs() < 1e-13);
    }

    #[test]
    fn exact_refusal_of_equal_columns() {
        assert!(fit(&[vec![1.0; 5], vec![2.0; 5]], &[1.0; 5]).is_none());
    }
}
