"""Writes vectors/pictures.json: figures of flip-evaluator 1.7, scikit-image 0.26 and numpy for
pictures that are defined by integers, so that Rust makes the very same ones (tests/vectors.rs).

    pip install flip-evaluator==1.7 scikit-image==0.26
    python crates/picture/tests/reference.py > vectors/pictures.json
"""

import json
import sys

import flip_evaluator
import numpy as np
from skimage.metrics import structural_similarity

# Every STEP-th pixel's FLIP along both axes is written.
STEP = int(sys.argv[1]) if len(sys.argv) > 1 else 9


def noise(x, y, channel, seed):
    n = (x * 0x9E3779B1 + y * 0x85EBCA77 + channel * 0xC2B2AE3D + seed * 0x27D4EB2F) & 0xFFFFFFFF
    for shift, factor in ((15, 0x2C1B3C6D), (12, 0x297A2D39)):
        n = ((n ^ (n >> shift)) * factor) & 0xFFFFFFFF
    return n ^ (n >> 15)


def scene(x, y, c, width, height):
    """0 to 1023: gradients, a checkerboard, a disc, thin lines."""
    value = (x * 1023 // (width - 1), y * 1023 // (height - 1), 200 + 600 * ((x // 8 + y // 8) % 2))[c]
    if (x - width // 3) ** 2 + (y - height // 2) ** 2 < 100:
        value = (900, 120, 60)[c]
    if x % 16 == 11 and y > height // 2:
        value = 1023 - value
    return value


def codes(width, height, seed, judged):
    """Of 1023. The judged picture has noise, a patch shifted by a pixel and a tinted one."""
    pixels = np.zeros((height, width, 3), np.int64)
    for y in range(height):
        for x in range(width):
            for c in range(3):
                shift = judged and y < height // 3
                value = scene(x + shift, y, c, width, height)
                if judged:
                    value += noise(x, y, c, seed) % 129 - 64 if x < width // 2 else 0
                    value += (90, 0, -60)[c] if y > 2 * height // 3 else 0
                pixels[y, x, c] = min(max(value, 0), 1023)
    return pixels


def light(width, height, seed, judged):
    """Codes squared, with a bright window, a lamp, and a black corner."""
    of = codes(width, height, seed, judged)
    values = (of * of).astype(np.float32) / np.float32(1 << 20)
    for y in range(height):
        for x in range(width):
            if x >= 3 * width // 4 and y < height // 2:
                values[y, x] *= 64
            if noise(x // 2, y // 2, 7, seed) % 200 == 0:
                values[y, x] *= 4096
            if x < 6 and y < 6:
                values[y, x] = 0
    return values


def pixels(error):
    height, width = error.shape[:2]
    return [
        [x, y, round(float(error[y, x, 0]), 5)]
        for y in range(0, height, STEP)
        for x in range(0, width, STEP)
    ]


def figures(a, b):
    a, b = a.astype(np.float64), b.astype(np.float64)
    mse = float(np.mean((a - b) ** 2))
    return {
        "mse": mse,
        "relative_mse": float(np.mean((a - b) ** 2 / (a * a + 0.01))),
        "psnr": float(-10 * np.log10(mse)),
    }


def flip(a, b, dynamic_range, ppd):
    parameters = {} if ppd is None else {"ppd": ppd}
    error, mean, used = flip_evaluator.evaluate(
        a, b, dynamic_range, applyMagma=False, parameters=parameters
    )
    found = {"mean": mean, "pixels": pixels(error)}
    if dynamic_range == "HDR":
        found |= {"start": used["startExposure"], "stop": used["stopExposure"]}
        found |= {"exposures": used["numExposures"]}
    return found


def coded_case(width, height, seed, ppd):
    a, b = (codes(width, height, seed, j).astype(np.float32) / np.float32(1023) for j in (False, True))
    ssim = structural_similarity(
        a.astype(np.float64), b.astype(np.float64), gaussian_weights=True, sigma=1.5,
        use_sample_covariance=False, data_range=1, channel_axis=2,
    )
    case = {"width": width, "height": height, "seed": seed, "ppd": ppd}
    return case | figures(a, b) | {"ssim": float(ssim), "flip": flip(a, b, "LDR", ppd)}


def light_case(width, height, seed, ppd):
    a, b = (light(width, height, seed, j) for j in (False, True))
    case = {"width": width, "height": height, "seed": seed, "ppd": ppd}
    luminance = a.astype(np.float64) @ np.array([0.2126, 0.7152, 0.0722])
    case["exposure"] = float(1 / np.percentile(luminance, 99))
    scaled = [p * np.float64(case["exposure"]) for p in (a, b)]
    gamma = [p ** (1 / 2.2) for p in scaled]
    case |= figures(*scaled)
    case["psnr"] = figures(*(np.clip(p, 0, 1) for p in gamma))["psnr"]
    case["psnr_unclamped"] = figures(*gamma)["psnr"]
    return case | {"flip_hdr": flip(a, b, "HDR", ppd)}


SIZES = [(64, 48, 1, None), (37, 71, 2, None), (50, 50, 3, 30.0), (61, 40, 4, 120.0)]
lines = {
    kind: ",\n    ".join(json.dumps(case(*size), separators=(",", ":")) for size in SIZES)
    for kind, case in (("coded", coded_case), ("linear", light_case))
}
print("{\n  " + ",\n  ".join(f'"{k}": [\n    {v}\n  ]' for k, v in lines.items()) + "\n}")
