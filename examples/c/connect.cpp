// A small bidirectional path tracer that is not hrr's, with its own scene, materials, rays and weights. At rough eye
// vertices it connects as such renderers do, to the vertices of one light subpath; at glossy ones libhrr picks from the
// vertices of all light subpaths. Rendered both ways, a metal ring's caustic is seen in a glossy mirror.
//
//   connect [WIDTH [ITERATIONS [DIRECTORY]]]     writes without.ppm and with.ppm to the directory, if there is one
//
// Where to look: `cache_of` builds the cache, `Integrator::connect_by_roulette` queries it, and `Integrator::attempts`
// is all that weights need to know: how often a technique tries a path. For the roulette that is N P.
#include "hrr.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>

namespace {

const double PI = 3.14159265358979323846;

// ---- vectors and random numbers

struct Vec {
  double x = 0, y = 0, z = 0;
};
Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec operator*(Vec a, Vec b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
Vec operator*(Vec a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec cross(Vec a, Vec b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
double length(Vec a) { return std::sqrt(dot(a, a)); }
Vec unit(Vec a) { return a * (1 / length(a)); }
double luminance(Vec a) { return 0.2126 * a.x + 0.7152 * a.y + 0.0722 * a.z; }

struct Frame {
  Vec x, y, z;
  explicit Frame(Vec n) : z(n) {
    x = unit(cross(std::fabs(n.x) > 0.5 ? Vec{0, 1, 0} : Vec{1, 0, 0}, n));
    y = cross(n, x);
  }
  Vec local(Vec v) const { return {dot(v, x), dot(v, y), dot(v, z)}; }
  Vec world(Vec v) const { return x * v.x + y * v.y + z * v.z; }
};

// SplitMix64 over a key of the library's: no two subpaths share a number.
class Random {
public:
  explicit Random(uint64_t key) : state_(key) {}
  double operator()() {
    uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * (1.0 / 9007199254740992.0);
  }

private:
  uint64_t state_;
};

Vec cosine_direction(Random &u) {
  double r = std::sqrt(u()), phi = 2 * PI * u();
  return {r * std::cos(phi), r * std::sin(phi), std::sqrt(std::fmax(0.0, 1 - r * r))};
}

// ---- materials: Lambert, or a rough metal (GGX, separable shadowing would do; this is the height-correlated one)

struct Material {
  Vec color;
  double alpha; // 0 = Lambert
  Vec emission;
  bool glossy() const { return alpha > 0 && alpha <= 0.1; }

  // All directions away from the surface, in the local frame whose z is on wo's side.
  double distribution(Vec h) const {
    double t = (h.x * h.x + h.y * h.y) / (alpha * alpha) + h.z * h.z;
    return 1 / (PI * alpha * alpha * t * t);
  }
  double lambda(Vec w) const {
    return 0.5 * (std::sqrt(1 + alpha * alpha * (w.x * w.x + w.y * w.y) / (w.z * w.z)) - 1);
  }
  Vec f(Vec wo, Vec wi) const {
    if (wo.z <= 0 || wi.z <= 0) {
      return {};
    }
    if (alpha == 0) {
      return color * (1 / PI);
    }
    double masking = 1 / (1 + lambda(wo) + lambda(wi));
    return color * (distribution(unit(wo + wi)) * masking / (4 * wo.z * wi.z));
  }
  double pdf(Vec wo, Vec wi) const {
    if (wo.z <= 0 || wi.z <= 0) {
      return 0;
    }
    if (alpha == 0) {
      return wi.z / PI;
    }
    return distribution(unit(wo + wi)) / (4 * wo.z * (1 + lambda(wo)));
  }
  // Visible normals [Heitz 2018].
  Vec sample(Vec wo, Random &u) const {
    if (alpha == 0) {
      return cosine_direction(u);
    }
    Frame view(unit(Vec{alpha * wo.x, alpha * wo.y, wo.z}));
    double r = std::sqrt(u()), phi = 2 * PI * u();
    double a = r * std::cos(phi), b = r * std::sin(phi), s = 0.5 * (1 + view.z.z);
    // x must lie in the surface for the half disk below.
    double across = std::hypot(view.z.x, view.z.y);
    view.x = across > 1e-12 ? Vec{-view.z.y / across, view.z.x / across, 0} : Vec{1, 0, 0};
    view.y = cross(view.z, view.x);
    b = (1 - s) * std::sqrt(std::fmax(0.0, 1 - a * a)) + s * b;
    Vec h = view.world({a, b, std::sqrt(std::fmax(0.0, 1 - a * a - b * b))});
    h = unit({alpha * h.x, alpha * h.y, std::fmax(1e-12, h.z)});
    return h * (2 * dot(wo, h)) - wo;
  }
};

// ---- the scene: rectangles and a ring, seen from both sides

struct Hit {
  double t = INFINITY;
  Vec p, n;
  int material = -1;
};

struct Rectangle {
  Vec corner, u, v;
  int material;
  Vec normal() const { return unit(cross(u, v)); }
  double area() const { return length(cross(u, v)); }
};

struct Scene {
  std::vector<Material> materials = {
      {{0.60, 0.58, 0.55}, 0, {}},            // floor and wall
      {{0.95, 0.78, 0.45}, 0.04, {}},         // ring: brass
      {{0.92, 0.93, 0.94}, 0.01, {}},         // mirror
      {{0, 0, 0}, 0, {110, 105, 95}},         // light
      {{0.25, 0.35, 0.60}, 0, {}},            // wall at the side
  };
  std::vector<Rectangle> rectangles = {
      {{-2.5, -2.5, 0}, {5, 0, 0}, {0, 5, 0}, 0},          // floor
      {{-1.5, 1.3, 0.02}, {3, 0, 0}, {0, -0.45, 1.4}, 2},  // mirror, leaning over the floor
      {{-2.5, 2.5, 0}, {5, 0, 0}, {0, 0, 3}, 0},           // back wall
      {{-2.5, -2.5, 0}, {0, 5, 0}, {0, 0, 3}, 4},          // left wall
      {{1.3, -0.9, 1.5}, {0, 0.25, 0}, {0.15, 0, -0.2}, 3}, // light, towards the ring
  };
  Vec ring_center = {0.1, 0.0, 0.0};
  double ring_radius = 0.55, ring_height = 0.3;
  const Rectangle &light = rectangles[4];

  double area() const {
    double sum = 2 * PI * ring_radius * ring_height * 2;
    for (const Rectangle &r : rectangles) {
      sum += r.area();
    }
    return sum;
  }

  Hit intersect(Vec o, Vec d, double t_max = INFINITY) const {
    const double t_min = 1e-6;
    Hit hit;
    hit.t = t_max;
    for (const Rectangle &r : rectangles) {
      Vec n = cross(r.u, r.v);
      double t = dot(r.corner - o, n) / dot(d, n);
      if (t > t_min && t < hit.t) {
        Vec q = o + d * t - r.corner;
        double a = dot(q, r.u) / dot(r.u, r.u), b = dot(q, r.v) / dot(r.v, r.v);
        if (a >= 0 && a <= 1 && b >= 0 && b <= 1) {
          hit = {t, o + d * t, unit(n), r.material};
        }
      }
    }
    Vec q = o - ring_center;
    double a = d.x * d.x + d.y * d.y, b = q.x * d.x + q.y * d.y, c = q.x * q.x + q.y * q.y - ring_radius * ring_radius;
    double root = b * b - a * c;
    if (root > 0) {
      for (double sign : {-1.0, 1.0}) {
        double t = (-b + sign * std::sqrt(root)) / a;
        Vec p = o + d * t;
        if (t > t_min && t < hit.t && p.z > 0.0 && p.z < ring_height) {
          hit = {t, p, Vec{(p.x - ring_center.x) / ring_radius, (p.y - ring_center.y) / ring_radius, 0}, 1};
        }
      }
    }
    return hit;
  }

  bool sees(Vec a, Vec b) const {
    double d = length(b - a);
    return intersect(a, (b - a) * (1 / d), d - 1e-6).material < 0;
  }
};

struct Camera {
  int width, height;
  Vec position = {-0.75, -2.3, 1.75};
  Frame frame = Frame(unit(Vec{0.1, 0.65, 0.5} - Vec{-0.75, -2.3, 1.75}));
  double half = std::tan(0.5 * 44 * PI / 180); // of the width, at distance 1
  Vec right = unit(cross(frame.z, Vec{0, 0, 1})), up = cross(right, frame.z);

  Camera(int w, int h) : width(w), height(h) {}
  Vec direction(double x, double y) const {
    double sx = (2 * x / width - 1) * half, sy = (1 - 2 * y / height) * half * height / width;
    return unit(frame.z + right * sx + up * sy);
  }
  // The pixel that a point is seen in; -1 for none.
  int pixel(Vec p) const {
    Vec d = p - position;
    double z = dot(d, frame.z);
    int x = static_cast<int>(std::floor((dot(d, right) / z / half + 1) * 0.5 * width));
    int y = static_cast<int>(std::floor((1 - dot(d, up) / z / (half * height / width)) * 0.5 * height));
    return z > 0 && x >= 0 && x < width && y >= 0 && y < height ? y * width + x : -1;
  }
  // Density per solid angle of a pixel's directions; also its importance.
  double pdf(Vec d) const {
    double c = dot(d, frame.z), side = 2 * half / width;
    return 1 / (side * side * c * c * c);
  }
};

// ---- subpaths

const int MOST_EDGES = 5;
const int MOST_LIGHT = 4; // vertices of a light subpath

struct Vertex {
  Vec p, n;
  int material = -1; // -1: the camera
  Vec beta;          // throughput up to here, without the scattering here
};
using Path = std::vector<Vertex>;

// A path's vertices, the light first.
using Whole = std::array<const Vertex *, MOST_EDGES + 1>;

class Integrator {
public:
  Integrator(const Scene &scene, const Camera &camera, bool roulette)
      : scene_(scene), camera_(camera), roulette_(roulette), paths_(size_t(camera.width) * camera.height) {}

  // One iteration: a light subpath and an eye subpath for each pixel. Returns each pixel's estimate.
  std::vector<Vec> iterate(const hrr::Context &context, uint64_t iteration) {
    parallel([&](size_t i, std::vector<Vec> &) { paths_[i] = light_path(Random(hrr_key(1, iteration, i, 0))); });
    if (roulette_) {
      cache_ = cache_of(context);
      if (iteration == 0) {
        // Fixed from here on, so that iterations stay independent of each other.
        constant_ = hrr::constant_for(3, scene_.area(), cache_.info().vertex_count);
      }
    }
    return parallel([&](size_t i, std::vector<Vec> &film) {
      for (size_t s = 2; s <= paths_[i].size(); s++) {
        splat(paths_[i], s, film);
      }
      film[i] = film[i] + eye_path(i, iteration);
    });
  }

private:
  template <class Work> std::vector<Vec> parallel(Work work) const {
    const size_t count = 4;
    std::vector<std::vector<Vec>> films(count, std::vector<Vec>(paths_.size()));
    std::vector<std::thread> threads;
    for (size_t k = 0; k < count; k++) {
      threads.emplace_back([&, k] {
        for (size_t i = k; i < paths_.size(); i += count) {
          work(i, films[k]);
        }
      });
    }
    for (std::thread &thread : threads) {
      thread.join();
    }
    for (size_t k = 1; k < count; k++) {
      for (size_t i = 0; i < paths_.size(); i++) {
        films[0][i] = films[0][i] + films[k][i];
      }
    }
    return films[0];
  }

  Path light_path(Random u) const {
    const Rectangle &light = scene_.light;
    Vertex v;
    v.p = light.corner + light.u * u() + light.v * u();
    v.n = light.normal();
    v.material = light.material;
    v.beta = scene_.materials[3].emission * light.area();
    Path path(1, v);
    Vec d = Frame(v.n).world(cosine_direction(u));
    walk(path, d, v.beta * PI, MOST_LIGHT, u);
    return path;
  }

  void walk(Path &path, Vec direction, Vec beta, size_t most, Random &u) const {
    while (path.size() < most) {
      Hit hit = scene_.intersect(path.back().p, direction);
      if (hit.material < 0) {
        return;
      }
      Vertex v;
      v.p = hit.p;
      v.n = hit.n;
      v.material = hit.material;
      v.beta = beta;
      path.push_back(v);
      const Material &m = scene_.materials[v.material];
      Frame frame(dot(direction, v.n) < 0 ? v.n : v.n * -1);
      Vec wo = frame.local(direction * -1), wi = m.sample(wo, u);
      double pdf = m.pdf(wo, wi);
      if (!(pdf > 0)) {
        return;
      }
      beta = beta * m.f(wo, wi) * (wi.z / pdf);
      direction = frame.world(wi);
    }
  }

  // The light vertices of all subpaths, where they lie.
  hrr::Cache cache_of(const hrr::Context &context) const {
    std::vector<HrrSegment> segments;
    for (size_t i = 0; i < paths_.size(); i++) {
      if (paths_[i].size() > 1) {
        HrrSegment segment = HrrSegment();
        segment.position = &paths_[i][1].p; // not the vertex on the light: next-event estimation does that
        segment.position_stride = sizeof(Vertex);
        segment.count = paths_[i].size() - 1;
        segment.first_id = i * MOST_LIGHT + 1;
        segments.push_back(segment);
      }
    }
    return hrr::Cache(context, segments, HRR_DOUBLE3);
  }

  // Scattering at b from a to c: f, and the density per area at c.
  Vec f(const Vertex &a, const Vertex &b, const Vertex &c) const {
    Frame frame(dot(a.p - b.p, b.n) > 0 ? b.n : b.n * -1);
    return scene_.materials[b.material].f(frame.local(unit(a.p - b.p)), frame.local(unit(c.p - b.p)));
  }
  double pdf(const Vertex *a, const Vertex &b, const Vertex &c) const {
    Vec d = c.p - b.p;
    double d2 = dot(d, d);
    Vec w = d * (1 / std::sqrt(d2));
    double p;
    if (b.material < 0) {
      p = camera_.pdf(w);
    } else if (a == nullptr) {
      p = std::fmax(0.0, dot(w, b.n)) / PI;
    } else {
      Frame frame(dot(a->p - b.p, b.n) > 0 ? b.n : b.n * -1);
      p = scene_.materials[b.material].pdf(frame.local(unit(a->p - b.p)), frame.local(w));
    }
    return p * std::fabs(dot(w, c.n)) / d2;
  }

  HrrLobe lobe(const Vertex &v, const Vertex &previous) const {
    const Material &m = scene_.materials[v.material];
    const double n[3] = {v.n.x, v.n.y, v.n.z};
    Vec w = unit(previous.p - v.p);
    const double wo[3] = {w.x, w.y, w.z};
    return hrr::lobe_reflection(n, nullptr, wo, m.alpha, m.alpha, luminance(m.color));
  }

  // How often the technique with s light vertices tries a path of k edges, for each eye subpath.
  double attempts(const Whole &x, int k, int s) const {
    if (s == k) {
      return s >= 2 ? static_cast<double>(paths_.size()) : 0; // light tracing; not for what is seen directly
    }
    if (!roulette_ || s < 2 || !scene_.materials[x[s]->material].glossy()) {
      return 1;
    }
    HrrLobe own = lobe(*x[s], *x[s + 1]);
    const double y[3] = {x[s - 1]->p.x, x[s - 1]->p.y, x[s - 1]->p.z}, z[3] = {x[s]->p.x, x[s]->p.y, x[s]->p.z};
    return static_cast<double>(paths_.size()) * cache_.probability(&own, 1, constant_, y, z);
  }

  // The balance heuristic over all techniques, divided by the technique's own attempts.
  double weight(const Whole &x, int k, int technique) const {
    double from_light[MOST_EDGES + 1], from_eye[MOST_EDGES + 1];
    for (int i = 0; i <= k; i++) {
      int j = k - i;
      from_light[i] = i == 0 ? 1 / scene_.light.area() : pdf(i > 1 ? x[i - 2] : nullptr, *x[i - 1], *x[i]);
      from_eye[j] = j == k ? 1 : pdf(j + 2 <= k ? x[j + 2] : nullptr, *x[j + 1], *x[j]);
    }
    double sum = 0, own = 0;
    for (int s = 0; s <= k; s++) {
      double p = 1;
      for (int i = 0; i <= k; i++) {
        p *= i < s ? from_light[i] : from_eye[i];
      }
      if (s == technique) {
        own = p;
      }
      sum += p * attempts(x, k, s);
    }
    return sum > 0 ? own / sum : 0;
  }

  // The path made of s vertices of a light subpath and t of an eye subpath.
  static int join(const Path &light, size_t s, const Path &eye, size_t t, Whole &x) {
    for (size_t i = 0; i < s; i++) {
      x[i] = &light[i];
    }
    for (size_t i = 0; i < t; i++) {
      x[s + t - 1 - i] = &eye[i];
    }
    return static_cast<int>(s + t) - 1;
  }

  // Light tracing: a light vertex seen by the camera.
  void splat(const Path &light, size_t s, std::vector<Vec> &film) const {
    Path eye(1);
    eye[0].p = camera_.position;
    Whole x;
    int k = join(light, s, eye, 1, x);
    const Vertex &v = light[s - 1];
    int pixel = camera_.pixel(v.p);
    if (k > MOST_EDGES || pixel < 0) {
      return;
    }
    Vec d = v.p - camera_.position;
    double d2 = dot(d, d);
    Vec value = v.beta * f(light[s - 2], v, eye[0]) * (std::fabs(dot(d, v.n)) / (d2 * std::sqrt(d2)) *
                                                       camera_.pdf(d * (1 / std::sqrt(d2))));
    if (luminance(value) > 0 && scene_.sees(camera_.position, v.p)) {
      film[static_cast<size_t>(pixel)] = film[static_cast<size_t>(pixel)] + value * weight(x, k, k);
    }
  }

  // What a connection is worth, before division by its attempts: those are in the weight.
  Vec connect(const Path &light, size_t s, const Path &eye, size_t t) const {
    Whole x;
    int k = join(light, s, eye, t, x);
    const Vertex &a = light[s - 1], &b = eye[t - 1];
    Vec d = b.p - a.p;
    double d2 = dot(d, d);
    Vec value = a.beta * b.beta * f(eye[t - 2], b, a);
    if (s == 1) {
      value = value * (dot(d, a.n) > 0 ? 1 : 0); // emission; one-sided
    } else {
      value = value * f(light[s - 2], a, b);
    }
    value = value * (std::fabs(dot(d, a.n) * dot(d, b.n)) / (d2 * d2));
    if (!(luminance(value) > 0) || !scene_.sees(a.p, b.p)) {
      return {};
    }
    return value * weight(x, k, static_cast<int>(s));
  }

  Vec connect_by_roulette(const Path &eye, uint64_t key) const {
    const Vertex &z = eye.back();
    HrrLobe own = lobe(z, eye[eye.size() - 2]);
    HrrQuery query = HrrQuery();
    query.position[0] = z.p.x;
    query.position[1] = z.p.y;
    query.position[2] = z.p.z;
    query.lobes = &own;
    query.lobe_count = 1;
    query.mask = ~0u;
    query.constant = constant_;
    query.key = key;
    Vec sum;
    cache_.visit(query, [&](const HrrHit &hit) {
      const Path &light = paths_[hit.id / MOST_LIGHT];
      size_t s = hit.id % MOST_LIGHT + 1;
      if (s + eye.size() <= MOST_EDGES + 1) {
        // Each of N P attempts counts 1 / (N P); `weight` has divided by them already.
        sum = sum + connect(light, s, eye, eye.size());
      }
    });
    return sum;
  }

  Vec eye_path(size_t i, uint64_t iteration) const {
    Random u(hrr_key(1, iteration, i, 1));
    Path eye(1), whole;
    eye[0].p = camera_.position;
    double x = static_cast<double>(i % static_cast<size_t>(camera_.width)) + u();
    double y = static_cast<double>(i / static_cast<size_t>(camera_.width)) + u();
    whole = eye;
    walk(whole, camera_.direction(x, y), {1, 1, 1}, MOST_EDGES + 1, u);
    Vec sum;
    const Path &light = paths_[i];
    for (size_t t = 2; t <= whole.size(); t++) {
      eye.push_back(whole[t - 1]);
      const Vertex &v = eye.back();
      const Material &m = scene_.materials[v.material];
      if (m.emission.x > 0) {
        if (dot(eye[t - 2].p - v.p, v.n) > 0) { // a light that was met
          Whole all;
          int k = join(light, 0, eye, t, all);
          sum = sum + v.beta * m.emission * weight(all, k, 0);
        }
        break;
      }
      if (t + 1 <= MOST_EDGES + 1) { // next-event estimation, by a point of its own
        Path point(1, light[0]);
        point[0].p = scene_.light.corner + scene_.light.u * u() + scene_.light.v * u();
        sum = sum + connect(point, 1, eye, t);
      }
      if (roulette_ && m.glossy()) {
        sum = sum + connect_by_roulette(eye, hrr_key(2, iteration, i, t));
      } else {
        for (size_t s = 2; s <= light.size() && s + t <= MOST_EDGES + 1; s++) {
          sum = sum + connect(light, s, eye, t);
        }
      }
    }
    return sum;
  }

  const Scene &scene_;
  const Camera &camera_;
  bool roulette_;
  std::vector<Path> paths_;
  hrr::Cache cache_;
  double constant_ = 0;
};

// ---- the two renders and what they tell

struct Render {
  std::vector<Vec> mean, square; // of the pixels
  std::vector<double> in_mirror; // of the iterations
};

Render render(const hrr::Context &context, const Scene &scene, const Camera &camera, bool roulette, int iterations) {
  Integrator integrator(scene, camera, roulette);
  Render sum;
  sum.mean.resize(size_t(camera.width) * camera.height);
  sum.square.resize(sum.mean.size());
  for (int n = 0; n < iterations; n++) {
    std::vector<Vec> film = integrator.iterate(context, static_cast<uint64_t>(n));
    double mirror = 0;
    for (size_t i = 0; i < film.size(); i++) {
      sum.mean[i] = sum.mean[i] + film[i] * (1.0 / iterations);
      sum.square[i] = sum.square[i] + film[i] * film[i] * (1.0 / iterations);
      int w = camera.width, x = static_cast<int>(i) % w, y = static_cast<int>(i) / w;
      if (scene.intersect(camera.position, camera.direction(x + 0.5, y + 0.5)).material == 2) {
        mirror += luminance(film[i]);
      }
    }
    sum.in_mirror.push_back(mirror / static_cast<double>(film.size()));
  }
  return sum;
}

void write(const std::string &path, const Render &render, const Camera &camera) {
  std::FILE *file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) {
    std::fprintf(stderr, "%s cannot be written\n", path.c_str());
    std::exit(1);
  }
  std::fprintf(file, "P6\n%d %d\n255\n", camera.width, camera.height);
  for (const Vec &v : render.mean) {
    for (double x : {v.x, v.y, v.z}) {
      std::fputc(static_cast<int>(255 * std::pow(std::fmin(1, std::fmax(0, x)), 1 / 2.2) + 0.5), file);
    }
  }
  std::fclose(file);
}

// Mean and the variance of the mean.
std::pair<double, double> estimate(const std::vector<double> &values) {
  double n = static_cast<double>(values.size()), mean = 0, square = 0;
  for (double v : values) {
    mean += v / n;
    square += v * v / n;
  }
  return {mean, (square - mean * mean) / (n - 1)};
}

double mirror_variance(const Scene &scene, const Camera &camera, const Render &render) {
  double sum = 0;
  for (size_t i = 0; i < render.mean.size(); i++) {
    int w = camera.width, x = static_cast<int>(i) % w, y = static_cast<int>(i) / w;
    if (scene.intersect(camera.position, camera.direction(x + 0.5, y + 0.5)).material == 2) {
      sum += luminance(render.square[i] - render.mean[i] * render.mean[i]);
    }
  }
  return sum;
}

} // namespace

int main(int argc, char **argv) {
  int width = argc > 1 ? std::atoi(argv[1]) : 96, iterations = argc > 2 ? std::atoi(argv[2]) : 16;
  if (width < 8 || iterations < 2) {
    std::fprintf(stderr, "usage: connect [WIDTH [ITERATIONS [DIRECTORY]]]\n");
    return 2;
  }
  Scene scene;
  Camera camera(width, width * 3 / 4);
  hrr::Context context;
  Render without = render(context, scene, camera, false, iterations);
  Render with = render(context, scene, camera, true, iterations);
  if (argc > 3) {
    write(std::string(argv[3]) + "/without.ppm", without, camera);
    write(std::string(argv[3]) + "/with.ppm", with, camera);
  }
  std::pair<double, double> a = estimate(without.in_mirror), b = estimate(with.in_mirror);
  double error = std::sqrt(a.second + b.second);
  double ratio = mirror_variance(scene, camera, without) / mirror_variance(scene, camera, with);
  std::printf("in the mirror: %.5f +- %.5f without, %.5f +- %.5f with; variance without / with %.1f\n", a.first,
              std::sqrt(a.second), b.first, std::sqrt(b.second), ratio);
  if (!(std::fabs(a.first - b.first) < 4 * error)) {
    std::fprintf(stderr, "the two do not agree\n");
    return 1;
  }
  std::puts("all is well");
  return 0;
}
