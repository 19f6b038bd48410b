//! What is remembered of a row's steps while it runs.

use crate::model::{CORNERS, Pieces};
use crate::real::{Real, Scalar, Task};

/// Which of the equations are in force in a lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Branch {
    /// Directions in which motor and load slide; 0 where they are held.
    pub directions: [i8; 2],
    /// Pieces of the laws with corners.
    pub pieces: [i8; CORNERS],
}

impl Branch {
    /// That of a lane, with pieces where any are held.
    pub fn of<R: Real>(lane: usize, directions: &[R; 2], pieces: Option<&Pieces<R::Plain>>) -> Self {
        Self {
            directions: directions.map(|direction| direction.plain().get(lane) as i8),
            pieces: pieces.map_or([0; CORNERS], |pieces| pieces.map(|piece| piece.get(lane) as i8)),
        }
    }
}

/// The end of one accepted step.
#[derive(Clone, Copy, Debug)]
pub struct Record<S, const N: usize> {
    /// Time [s].
    pub t: f64,
    /// Length of the step that ended here [s]; 0 where a row starts or an input jumps, NaN where this step and some before
    /// it are forgotten.
    pub step: f64,
    /// State.
    pub state: [S; N],
    /// Motor acceleration [rad/s^2].
    pub alpha_m: f64,
    /// Load speed [rad/s].
    pub omega_l: f64,
    /// What is in force from here on.
    pub branch: Branch,
    /// Load acceleration [rad/s^2].
    pub alpha_l: f64,
}

/// Highest degree of a dense output, plus one.
pub const DENSE_TERMS: usize = 8;

/// One step as a polynomial in the elapsed share of the step.
#[derive(Clone, Copy, Debug)]
pub struct Dense<S, const N: usize> {
    /// Start of the step [s].
    pub t: f64,
    /// Length of the step [s].
    pub step: f64,
    /// Coefficients per state, see [`value_at`].
    pub coefficients: [[S; DENSE_TERMS]; N],
}

impl<S: Scalar, const N: usize> Dense<S, N> {
    /// The state after a share of the step.
    pub fn at(&self, share: S) -> [S; N] {
        S::apart(At { dense: self, share })
    }
}

struct At<'a, S, const N: usize> {
    dense: &'a Dense<S, N>,
    share: S,
}

impl<S: Scalar, const N: usize> Task for At<'_, S, N> {
    type Output = [S; N];

    #[inline(always)]
    fn run(self) -> [S; N] {
        let mut state = [S::zero(); N];
        for index in 0..N {
            state[index] = value_at(&self.dense.coefficients[index], self.dense.step, self.share);
        }
        state
    }
}

/// The value of a state after a share of the step, from its value at the start and the ascending coefficients of its
/// change per time, from the linear one.
#[inline(always)]
pub fn value_at<R: Real>(polynomial: &[R; DENSE_TERMS], step: R::Plain, share: R) -> R {
    let mut pace = polynomial[DENSE_TERMS - 1];
    for &coefficient in polynomial[1..DENSE_TERMS - 1].iter().rev() {
        pace = pace.mul_add(share, coefficient);
    }
    (pace * share).mul_add_plain(step, polynomial[0])
}

/// The numbers of one lane.
#[inline(always)]
pub fn lane_numbers<R: Real, const N: usize>(numbers: &[R; N], lane: usize) -> [R::Lane; N] {
    let mut own = [R::Lane::zero(); N];
    for index in 0..N {
        own[index] = numbers[index].get(lane);
    }
    own
}

/// The coefficients of one lane.
pub fn lane_coefficients<R: Real, const N: usize>(
    coefficients: &[[R; DENSE_TERMS]; N],
    lane: usize,
) -> [[R::Lane; DENSE_TERMS]; N] {
    let mut own = [[R::Lane::zero(); DENSE_TERMS]; N];
    for index in 0..N {
        own[index] = lane_numbers(&coefficients[index], lane);
    }
    own
}
