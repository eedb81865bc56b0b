//! The box and triangle tests in plain Rust, one lane after the other; see [`super::walk`].

use super::triangle_bvh::{Block, LANES};
use super::walk::{BoxHits, Setup, TriangleHits, WIDEN};
use super::wide::Node;

#[inline(always)]
pub(super) fn boxes_portable(node: &Node, ray: &Setup, t_max: f32) -> BoxHits {
    let mut hits = BoxHits { mask: 0, t: [0.0; 8] };
    for lane in 0..8 {
        let mut enter = 0.0f32;
        let mut leave = f32::INFINITY;
        for axis in 0..3 {
            let (planes, down) = (&node.planes[axis], ray.goes_down(axis));
            let near = planes[usize::from(down)][lane] - ray.origin[axis];
            let far = planes[usize::from(!down)][lane] - ray.origin[axis];
            enter = enter.max(near * ray.inverse[axis]);
            leave = leave.min(far * ray.inverse[axis]);
        }
        leave = (leave * WIDEN).min(t_max);
        hits.t[lane] = enter;
        hits.mask |= u32::from(enter <= leave) << lane;
    }
    hits
}

pub(super) fn triangles_portable(block: &Block, ray: &Setup, t_max: f32) -> TriangleHits {
    let mut hits = TriangleHits { mask: 0, t: [0.0; LANES], u: [0.0; LANES], v: [0.0; LANES] };
    // Sheared x and y, and unsheared z, of a corner.
    let corner = |vertex: usize, lane: usize| {
        let at = |k: usize| block.corners[vertex][ray.axes[k]][lane] - ray.origin[ray.axes[k]];
        let z = at(2);
        [at(0) - ray.shear[0] * z, at(1) - ray.shear[1] * z, z]
    };
    for lane in 0..LANES {
        let [a, b, c] = [corner(0, lane), corner(1, lane), corner(2, lane)];
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let sum = u + v + w;
        if !(u.min(v).min(w) >= 0.0 || u.max(v).max(w) <= 0.0) || sum == 0.0 {
            continue;
        }
        let t = (u * a[2] + v * b[2] + w * c[2]) * ray.shear[2] / sum;
        if t > 0.0 && t <= t_max {
            hits.mask |= 1 << lane;
            (hits.t[lane], hits.u[lane], hits.v[lane]) = (t, v / sum, w / sum);
        }
    }
    hits
}
