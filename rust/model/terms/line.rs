//! A line of the kinematic error.

use super::{Mesh, Motion};
use crate::real::Real;

/// Adds `cosine cos(order theta_m) + sine sin(order theta_m)`.
#[inline(always)]
pub fn add_line<R: Real>(mesh: &mut Mesh<R>, motion: &Motion<R>, order: R, cosine: R, sine: R) {
    let (s, c) = (order * motion.theta_m).sin_cos();
    let value = cosine.mul_add(c, sine * s);
    mesh.error = mesh.error + value;
    mesh.error_slope = order.mul_add(sine * c - cosine * s, mesh.error_slope);
    mesh.error_curvature = mesh.error_curvature - order * order * value;
}
