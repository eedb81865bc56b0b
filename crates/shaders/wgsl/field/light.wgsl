// The light of all volumes, sampled as `light::Light` does.
//
// Volumes are told by their number, and of each no more is read than is needed: a shader that reads all
// of a volume at every step spends most of its time on that.

#import common/harmonics
#import common/math
#import field/bindings
#import field/volume

fn cell_of(number: u32, position: vec3f) -> vec3f {
    return transform_point(volumes[number].cell_from_world, position);
}

// A normal along the box's axes.
fn out_of(number: u32, normal: vec3f) -> vec3f {
    return transform_vector(volumes[number].cell_from_world, normal) * volumes[number].spacing;
}

// Where a surface's point counts as lying when volumes share it (ProbeVolume::place).
fn place_of(number: u32, position: vec3f, normal: vec3f) -> vec3f {
    let cells = max(volumes[number].offset, vec3f(0.5));
    return cell_of(number, position) + cells * out_of(number, normal);
}

// Where the texture is read for a surface: in cells, clamped to the outermost probes.
fn sampled_cell(number: u32, position: vec3f, normal: vec3f) -> vec3f {
    let cell = cell_of(number, position) + volumes[number].offset * out_of(number, normal);
    return clamp(cell, vec3f(0.0), volumes[number].resolution - 1.0);
}

// What two lobes see from a cell of a volume.
fn volume_light(number: u32, cell: vec3f, a: Lobe, b: Lobe) -> TwoLobes {
    let slices = volumes[number].resolution.z;
    let texels = texels_at(atlas, volumes[number].origin, slices, cell, volumes[number].texels);
    let light = stored_light(atlas, atlas_sampler, texels, a, b);
    let scale = volumes[number].scale;
    return TwoLobes(light.a * scale, light.b * scale);
}

// What two lobes see at a point of a surface (Light::sample): the finest volume counts, passing
// smoothly into the next; beyond all of them the nearest one's border does. Negative light, which
// truncated expansions have, is none. Each volume is read once at most, whatever of the point it has.
fn field_light(position: vec3f, normal: vec3f, a: Lobe, b: Lobe) -> TwoLobes {
    if fields.count == 1u {
        // All that there is has all of every point.
        let light = volume_light(0u, sampled_cell(0u, position, normal), a, b);
        return TwoLobes(max(light.a, vec3f(0.0)), max(light.b, vec3f(0.0)));
    }
    var unclaimed = 1.0;
    for (var i = 0u; i < fields.count && unclaimed > 0.0; i++) {
        unclaimed -= unclaimed * weight_in(volumes[i].resolution, place_of(i, position, normal));
    }
    var reach = 0.0;
    var nearest = 0u;
    if unclaimed > 0.0 {
        var least = 3.4e38;
        for (var i = 0u; i < fields.count; i++) {
            let resolution = volumes[i].resolution;
            let place = place_of(i, position, normal);
            reach += reach_of(resolution, place);
            // Metres (Grid::beyond).
            let distance = length(outside(resolution, place) * volumes[i].spacing);
            if distance < least {
                nearest = i;
                least = distance;
            }
        }
    }
    var sum = TwoLobes(vec3f(0.0), vec3f(0.0));
    var remaining = 1.0;
    for (var i = 0u; i < fields.count && remaining + unclaimed > 0.0; i++) {
        let resolution = volumes[i].resolution;
        let place = place_of(i, position, normal);
        let claimed = remaining * weight_in(resolution, place);
        remaining -= claimed;
        var share = select(0.0, 1.0, i == nearest);
        if reach > 0.0 {
            share = reach_of(resolution, place) / reach;
        }
        let weight = claimed + unclaimed * share;
        if weight > 0.0 {
            let light = volume_light(i, sampled_cell(i, position, normal), a, b);
            sum.a += weight * light.a;
            sum.b += weight * light.b;
        }
    }
    return TwoLobes(max(sum.a, vec3f(0.0)), max(sum.b, vec3f(0.0)));
}
