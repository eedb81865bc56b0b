// Morph targets and skins: the vertices of a primitive of a deforming instance, a thread each. What
// `scene::deform` computes; glTF 2.0, sections 3.7.2.2 and 3.7.3.

#import common/math
#import surface/deform_bindings

struct Shape {
    position: vec3f,
    normal: vec3f,
    // w: the sign of the bitangent.
    tangent: vec4f,
}

// Numbers of a vertex in `rest` and `deformed`: position, normal, tangent.
const SHAPE: u32 = 10u;
// Numbers of a vertex in `displacements`, target by target: of position, normal, tangent.
const DISPLACEMENT: u32 = 9u;

fn at_rest(vertex: u32) -> Shape {
    let i = SHAPE * vertex;
    return Shape(
        vec3f(rest[i], rest[i + 1u], rest[i + 2u]),
        vec3f(rest[i + 3u], rest[i + 4u], rest[i + 5u]),
        vec4f(rest[i + 6u], rest[i + 7u], rest[i + 8u], rest[i + 9u]),
    );
}

fn displacement(i: u32) -> vec3f {
    return vec3f(displacements[i], displacements[i + 1u], displacements[i + 2u]);
}

// A vector of length one, or what stands in where there is no direction.
fn unit_or(v: vec3f, otherwise: vec3f) -> vec3f {
    let squared = dot(v, v);
    return select(otherwise, v * inverseSqrt(squared), squared > 0.0);
}

fn morphed(vertex: u32) -> Shape {
    let still = at_rest(vertex);
    var s = still;
    for (var m = 0u; m < deform.morphs; m++) {
        let morph = morphs[m];
        let i = DISPLACEMENT * (morph.number * deform.vertices + vertex);
        s.position += morph.weight * displacement(i);
        s.normal += morph.weight * displacement(i + 3u);
        s.tangent += vec4f(morph.weight * displacement(i + 6u), 0.0);
    }
    if deform.morphs > 0u {
        s.normal = unit_or(s.normal, still.normal);
        s.tangent = vec4f(unit_or(s.tangent.xyz, still.tangent.xyz), still.tangent.w);
    }
    return s;
}

// The transforms of a vertex's joints, in the proportion of their weights.
fn blended(vertex: u32) -> array<vec4f, 3> {
    var rows: array<vec4f, 3>;
    for (var four = 0u; four < deform.influences; four++) {
        let influence = influences[vertex * deform.influences + four];
        for (var i = 0u; i < 4u; i++) {
            let number = (influence.joints[i / 2u] >> (16u * (i % 2u))) & 0xffffu;
            let joint = min(number, deform.joints);
            for (var row = 0u; row < 3u; row++) {
                rows[row] += influence.weights[i] * pose[joint][row];
            }
        }
    }
    return rows;
}

fn skinned(s: Shape, vertex: u32) -> Shape {
    let rows = blended(vertex);
    let x = rows[0].xyz;
    let y = rows[1].xyz;
    let z = rows[2].xyz;
    // The inverse transpose up to a positive factor, also where there is none.
    let turned = select(1.0, -1.0, dot(x, cross(y, z)) < 0.0);
    let n = s.normal;
    let cofactors = vec3f(dot(cross(y, z), n), dot(cross(z, x), n), dot(cross(x, y), n));
    return Shape(
        transform_point(rows, s.position),
        unit_or(turned * cofactors, n),
        vec4f(unit_or(transform_vector(rows, s.tangent.xyz), s.tangent.xyz), turned * s.tangent.w),
    );
}

fn shape_of(vertex: u32) -> Shape {
    let s = morphed(vertex);
    if (deform.flags & DEFORM_SKINNED) == 0u {
        return s;
    }
    return skinned(s, vertex);
}

fn face_normal(a: vec3f, b: vec3f, c: vec3f) -> vec3f {
    let p = b - a;
    let q = c - a;
    // Scaled edges have a product that does not vanish, however small they are.
    let extent = max(abs(p), abs(q));
    let scale = max(max(extent.x, extent.y), extent.z);
    return unit_or(cross(p / scale, q / scale), vec3f(0.0, 1.0, 0.0));
}

const ROW: u32 = 65535u * 64u;

@compute @workgroup_size(64)
fn deform_vertices(@builtin(global_invocation_id) id: vec3u) {
    let vertex = id.x + ROW * id.y;
    if vertex >= deform.vertices {
        return;
    }
    var s = shape_of(vertex);
    if (deform.flags & DEFORM_FLAT) != 0u {
        let first = vertex - vertex % 3u;
        let a = shape_of(first).position;
        let b = shape_of(first + 1u).position;
        s.normal = face_normal(a, b, shape_of(first + 2u).position);
    }
    let i = SHAPE * vertex;
    for (var axis = 0u; axis < 3u; axis++) {
        deformed[i + axis] = s.position[axis];
        deformed[i + 3u + axis] = s.normal[axis];
        deformed[i + 6u + axis] = s.tangent[axis];
    }
    deformed[i + 9u] = s.tangent.w;
}
