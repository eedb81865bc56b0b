// From linear colour to display codes: twins of `picture::ToneMap`.

const TONE_GAMMA: u32 = 0u;
const TONE_SRGB: u32 = 1u;
const TONE_REINHARD: u32 = 2u;
const TONE_FILMIC: u32 = 3u;
const TONE_NEUTRAL: u32 = 4u;

// The luminance of linear Rec. 709 colour.
fn luminance(linear: vec3f) -> f32 {
    return dot(linear, vec3f(0.2126, 0.7152, 0.0722));
}

// Display codes, 0 to 1, of linear colour of which 1 is white.
fn display_code(linear: vec3f, tone_map: u32) -> vec3f {
    let light = max(linear, vec3f(0.0));
    switch tone_map {
        case TONE_GAMMA: {
            return pow(min(light, vec3f(1.0)), vec3f(1.0 / 2.2));
        }
        case TONE_REINHARD: {
            return srgb_code(light / (1.0 + luminance(light)));
        }
        case TONE_FILMIC: {
            return srgb_code(filmic(light));
        }
        case TONE_NEUTRAL: {
            return srgb_code(neutral(light));
        }
        default: {
            return srgb_code(light);
        }
    }
}

// Clamped, then the curve of IEC 61966-2-1.
fn srgb_code(linear: vec3f) -> vec3f {
    let v = min(linear, vec3f(1.0));
    let curve = 1.055 * pow(v, vec3f(1.0 / 2.4)) - 0.055;
    return select(curve, 12.92 * v, v <= vec3f(0.0031308));
}

// Narkowicz's curve (2016) at exposure 0.6.
fn filmic(linear: vec3f) -> vec3f {
    let x = 0.6 * min(linear, vec3f(1e4));
    return saturate(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14));
}

// Khronos PBR Neutral.
fn neutral(linear: vec3f) -> vec3f {
    const F90 = 0.04;
    const START = 0.8 - F90;
    const DESATURATION = 0.15;
    let light = min(linear, vec3f(1e9));
    let least = min(light.x, min(light.y, light.z));
    let offset = select(F90, least - least * least / (4.0 * F90), least < 2.0 * F90);
    let color = light - offset;
    let peak = max(color.x, max(color.y, color.z));
    if peak < START {
        return color;
    }
    let room = 1.0 - START;
    let compressed = 1.0 - room * room / (peak + room - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    return mix(color * (compressed / peak), vec3f(compressed), white);
}
