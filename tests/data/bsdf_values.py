#!/usr/bin/env python3
"""Writes bsdf_values.txt: GGX values with 80 digits, by the formulas as the papers write them.

Columns: lobe (R reflection with F = 1, T refraction from index 1 to 1.5), alpha_x, alpha_y, wo (3), wi (3), D(h), f for
light from wi to wo, density of wi given wo (visible normals). Directions are doubles and exact in this table.
"""

import math
import random
from decimal import Decimal, getcontext

getcontext().prec = 80
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494459230781640628620899862803482534")
IOR = 1.5
ROUGHNESS = [(1e-1, 1e-1), (1e-2, 1e-3), (1e-4, 1e-4), (1e-4, 1e-2), (1e-7, 1e-7), (1e-7, 1e-1)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def normalize(v):
    return [x / math.sqrt(dot(v, v)) for x in v]


def distribution(m, ax, ay):
    """D with the angles of the normal [Heitz 2014]."""
    cos2 = m[2] ** 2
    sin2 = m[0] ** 2 + m[1] ** 2
    tan2 = sin2 / cos2
    exponent = tan2 * (m[0] ** 2 / sin2 / ax**2 + m[1] ** 2 / sin2 / ay**2)
    return 1 / (PI * ax * ay * cos2**2 * (1 + exponent) ** 2)


def smith_lambda(w, ax, ay):
    """Lambda [Heitz 2014]."""
    a2 = ((ax * w[0]) ** 2 + (ay * w[1]) ** 2) / w[2] ** 2
    return ((1 + a2).sqrt() - 1) / 2


def fresnel(cos_i, eta):
    cos_t = (1 - (1 - cos_i**2) / eta**2).sqrt()
    p = (eta * cos_i - cos_t) / (eta * cos_i + cos_t)
    s = (cos_i - eta * cos_t) / (cos_i + eta * cos_t)
    return (p * p + s * s) / 2


def pair(lobe, ax, ay, cos):
    """Directions within three widths of a lobe."""
    while True:
        phi = random.uniform(0, 2 * math.pi)
        sin = math.sqrt(1 - cos * cos)
        wo = normalize([sin * math.cos(phi), sin * math.sin(phi), cos])
        r, t = random.uniform(0, 3), random.uniform(0, 2 * math.pi)
        m = normalize([ax * r * math.cos(t), ay * r * math.sin(t), 1.0])
        c = dot(wo, m)
        if lobe == "R":
            wi = normalize([2 * c * n - w for w, n in zip(wo, m)])
        else:
            cos_t = math.sqrt(1 - (1 - c * c) / IOR**2)
            wi = normalize([-w / IOR + (c / IOR - cos_t) * n for w, n in zip(wo, m)])
        if c > 0 and (wi[2] > 0) == (lobe == "R"):
            return wo, wi


def row(lobe, ax, ay, wo, wi):
    o, i = [Decimal(x) for x in wo], [Decimal(x) for x in wi]
    ax, ay, eta = Decimal(ax), Decimal(ay), Decimal(IOR)
    lo, li = smith_lambda(o, ax, ay), smith_lambda(i, ax, ay)
    g1, g2 = 1 / (1 + lo), 1 / (1 + lo + li)
    h = [a + b if lobe == "R" else -(a + eta * b) for a, b in zip(o, i)]
    h = [x / dot(h, h).sqrt() for x in h]
    d = distribution(h, ax, ay)
    if lobe == "R":  # [Walter et al. 2007, eq. 20 and 14]
        return d, d * g2 / (4 * o[2] * i[2]), d * g1 / (4 * o[2])
    oh, ih = dot(o, h), dot(i, h)
    refracted = (1 - fresnel(oh, eta)) * d / (eta * ih + oh) ** 2  # [eq. 21 and 17]
    return d, refracted * g2 * abs(ih / i[2]) * oh / o[2], refracted * g1 * oh / o[2] * eta**2 * abs(ih)


def main():
    random.seed(5)
    with open("bsdf_values.txt", "w", encoding="ascii") as out:
        for ax, ay in ROUGHNESS:
            for cos in (0.9, 0.1, 1e-3):
                for lobe in "RT":
                    wo, wi = pair(lobe, ax, ay, cos)
                    values = [float(x) for x in row(lobe, ax, ay, wo, wi)]
                    print(lobe, *map(repr, [ax, ay, *wo, *wi, *values]), file=out)


main()
