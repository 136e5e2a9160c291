#!/usr/bin/env python3
"""Writes flip_values.txt with NVIDIA's package flip-evaluator (pip install flip-evaluator; 1.7 wrote the file).

Each line: width, height, number of the image pair, pixels per degree, the mean of LDR-FLIP, and its value in eight pixels.
The images are formulas (`image`, again in tests/flip.rs), linear RGB in single precision.
"""

import math
import os

import flip_evaluator
import numpy as np

PIXELS = [(0, 0), (1, 2), (5, 3), (10, 10), (17, 4), (3, 21), (22, 13), (23, 23)]


def image(width, height, number, test):
    out = np.zeros((height, width, 3), dtype=np.float32)
    for y in range(height):
        for x in range(width):
            for c in range(3):
                k = number + 1
                value = 0.5 + 0.5 * math.sin(0.3 * k * x + 0.2 * (c + 1) * y + c)
                if test and number == 0:
                    value *= 0.9
                if test and number == 1 and (x * 7 + y * 3 + c) % 11 == 0:
                    value = 1.0
                if test and number == 2:
                    value = 1.2 if (x - 10) ** 2 + (y - 8) ** 2 < 30 else value - 0.1
                if test and number == 3:
                    value = float(c == 2)
                elif number == 3:
                    value = float(c == 1)
                out[y, x, c] = np.float32(min(max(value, 0.0), 1.0))
    return out


lines = []
for number in range(4):
    for width, height, ppd in [(24, 24, 67.0206432766), (40, 30, 67.0206432766), (40, 30, 20.0)]:
        reference, test = (image(width, height, number, t) for t in (False, True))
        errors, mean, _ = flip_evaluator.evaluate(
            reference, test, "LDR", inputsRGB=False, applyMagma=False, parameters={"ppd": ppd}
        )
        values = " ".join(f"{float(errors[y, x, 0]):.6f}" for x, y in PIXELS)
        lines.append(f"{width} {height} {number} {ppd} {mean:.6f} {values}\n")
with open(os.path.join(os.path.dirname(__file__), "flip_values.txt"), "w") as f:
    f.writelines(lines)
