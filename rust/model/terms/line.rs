//! A line of the kinematic error.

use super::{Mesh, Motion};
use crate::real::Real;

/// Adds `cosine cos(order theta_m) + sine sin(order theta_m)`.
#[inline(always)]
pub fn add_line<R: Real>(mesh: &mut Mesh<R>, motion: &Motion<R>, order: R, cosine: R, sine: R) {
    let (s, c) = (order * motion.theta_m).sin_cos();
    mesh.error = cosine.mul_add(c, sine.mul_add(s, mesh.error));
    mesh.error_slope = order.mul_add(sine * c - cosine * s, mesh.error_slope);
}
