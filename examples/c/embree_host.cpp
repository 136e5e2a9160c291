// A host with an Embree scene of its own, whose answers it uses for libhrr's connections: what most renderers do. For
// comparison the same connections by hrr::Geometry. Needs Embree 4.
#include "hrr.hpp"

#include <embree4/rtcore.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace {

void require(bool holds, const char *what) {
  if (!holds) {
    std::fprintf(stderr, "does not hold: %s\n", what);
    std::exit(1);
  }
}

// The host's rays: a device and a scene with a square obstacle between the floor and the ceiling.
class HostScene {
public:
  HostScene(const float *positions, const unsigned *indices) : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *p = static_cast<float *>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 4));
    unsigned *t = static_cast<unsigned *>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, 2));
    for (int i = 0; i < 12; i++) {
      p[i] = positions[i];
    }
    for (int i = 0; i < 6; i++) {
      t[i] = indices[i];
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
    require(rtcGetDeviceError(device_) == RTC_ERROR_NONE, "the host's scene is built");
  }
  HostScene(const HostScene &) = delete;
  HostScene &operator=(const HostScene &) = delete;
  ~HostScene() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }

  bool occluded(const double from[3], const double to[3]) const {
    RTCRay ray = RTCRay();
    ray.org_x = static_cast<float>(from[0]);
    ray.org_y = static_cast<float>(from[1]);
    ray.org_z = static_cast<float>(from[2]);
    ray.dir_x = static_cast<float>(to[0] - from[0]);
    ray.dir_y = static_cast<float>(to[1] - from[1]);
    ray.dir_z = static_cast<float>(to[2] - from[2]);
    ray.tnear = 1e-4f;
    ray.tfar = 1 - 1e-4f;
    ray.mask = ~0u;
    rtcOccluded1(scene_, &ray, nullptr);
    return ray.tfar < 0;
  }

private:
  RTCDevice device_;
  RTCScene scene_;
};

} // namespace

int main() {
  // Light vertices on a ceiling, a square obstacle half-way, eye vertices on the floor.
  const float obstacle[12] = {-0.5f, -0.5f, 0.5f, 0.5f, -0.5f, 0.5f, 0.5f, 0.5f, 0.5f, -0.5f, 0.5f, 0.5f};
  const unsigned indices[6] = {0, 1, 2, 0, 2, 3};
  std::vector<float> ceiling;
  uint64_t state = 11;
  for (int i = 0; i < 30000; i++) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    ceiling.push_back(i % 3 == 2 ? 1.0f : 4 * (static_cast<float>(state >> 40) / 16777216.0f) - 2);
  }

  const HostScene host(obstacle, indices);
  const hrr::Context context;
  HrrSegment segment = HrrSegment();
  segment.position = ceiling.data();
  segment.count = ceiling.size() / 3;
  const hrr::Cache cache(context, {segment});

  HrrMesh mesh = HrrMesh();
  mesh.position = obstacle;
  mesh.vertex_count = 4;
  mesh.index = indices;
  mesh.triangle_count = 2;
  const hrr::Geometry geometry(context, {mesh});
  HrrLights lights = hrr::make<HrrLights>();
  lights.position = ceiling.data();
  lights.count = ceiling.size() / 3;

  const double normal[3] = {0, 0, 1}, wo[3] = {0.6, 0, 0.8};
  const HrrLobe lobes[2] = {hrr::lobe_reflection(normal, nullptr, wo, 0.2, 0.2), hrr::lobe_sphere(0.2)};
  std::vector<HrrHit> hits, visible;
  std::vector<uint8_t> occluded;
  size_t all = 0, seen = 0;
  for (uint64_t i = 0; i < 2000; i++) {
    HrrQuery query = HrrQuery();
    query.position[0] = static_cast<double>(i % 50) / 25 - 1;
    query.position[1] = static_cast<double>(i / 50) / 20 - 1;
    query.lobes = lobes;
    query.lobe_count = 2;
    query.mask = ~0u;
    query.constant = hrr::constant_for(5, 20, lights.count);
    query.key = hrr_key(1, 0, i, 0);
    cache.query(query, hits);
    size_t kept = 0;
    geometry.occluded(query.position, nullptr, lights, hits, occluded);
    cache.query_visible(geometry, query, nullptr, lights, visible);
    for (size_t k = 0; k < hits.size(); k++) {
      const float *p = &ceiling[3 * hits[k].id];
      const double light[3] = {p[0], p[1], p[2]};
      // The host's own answer; then it evaluates its BSDFs and weights, and divides by P and its light paths.
      const bool free = !host.occluded(query.position, light);
      require(free == (occluded[k] == 0), "both agree on what is seen");
      if (free) {
        require(kept < visible.size() && visible[kept].id == hits[k].id, "the combined call finds the same");
        kept++;
      }
    }
    require(kept == visible.size(), "the combined call finds no more");
    all += hits.size();
    seen += kept;
  }
  require(all > 1000 && seen > all / 10 && seen < all, "some light vertices are seen, some not");

  // Straight up from the floor's middle.
  HrrRay ray = HrrRay();
  ray.direction[2] = 1;
  ray.t_max = INFINITY;
  const HrrRayHit hit = geometry.intersect(ray);
  require(hit.mesh == 0 && hit.triangle < 2 && std::fabs(hit.t - 0.5f) < 1e-6f, "the obstacle is where it is");
  std::printf("%zu hits, %zu of them seen\n", all, seen);
  std::puts("all is well");
  return 0;
}
