/* Every function of hrr.h, with good arguments and with bad ones: for memory checkers (scripts/check_memory.sh).
 *
 *   every_function DIRECTORY SCENE */
#include "hrr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void expect(HrrStatus status, HrrStatus expected, int line) {
  if (status != expected) {
    fprintf(stderr, "line %d: %s, not %s: %s\n", line, hrr_status_name(status), hrr_status_name(expected),
            hrr_last_error());
    exit(1);
  }
}

static void require(int holds, int line) {
  if (!holds) {
    fprintf(stderr, "line %d does not hold\n", line);
    exit(1);
  }
}

#define OK(call) expect(call, HRR_OK, __LINE__)
#define BAD(call) expect(call, HRR_ERROR_INVALID_ARGUMENT, __LINE__)
#define FAILS(call, status) expect(call, status, __LINE__)
#define REQUIRE(holds) require(holds, __LINE__)

/* A host's functions. */
static int64_t held;
static int messages, steps;

static int32_t memory(void *user, int64_t bytes) {
  (void)user;
  held += bytes;
  return 0;
}

static void say(void *user, uint32_t level, const char *message) {
  (void)user;
  messages += level > 0 && strlen(message) > 0;
}

static int32_t go_on(void *user, double done) {
  steps += done >= 0 && user != NULL;
  return 0;
}

static int32_t stop(void *user, double done) {
  (void)user;
  (void)done;
  return 1;
}

static void in_turn(void *user, uint32_t count, HrrTaskFn task, void *data) {
  uint32_t i;
  (void)user;
  for (i = 0; i < count; i++) {
    task(data, i);
  }
}

static void never(void *user, uint32_t count, HrrTaskFn task, void *data) {
  (void)user;
  (void)count;
  (void)task;
  (void)data;
}

static int32_t count_hits(void *user, const HrrHit *hit) {
  *(uint64_t *)user += hit->probability > 0;
  return 0;
}

static int32_t refuse_hits(void *user, const HrrHit *hit) {
  (void)user;
  (void)hit;
  return -3;
}

enum { VERTICES = 500, QUERIES = 20, CAPACITY = 200 };

/* Vertices end where the memory ends, and nothing of them is aligned. */
static unsigned char *vertices(size_t stride) {
  unsigned char *bytes = malloc(1 + stride * (VERTICES - 1) + 24);
  size_t i;
  for (i = 0; i < VERTICES; i++) {
    const float p[3] = {(float)(i % 23) / 23, (float)(i % 7) / 7, (float)i / VERTICES};
    const uint32_t mask = 1u << (i % 4);
    const uint64_t id = 1000 + i;
    memcpy(bytes + 1 + i * stride, p, 12);
    memcpy(bytes + 1 + i * stride + 12, &mask, 4);
    memcpy(bytes + 1 + i * stride + 16, &id, 8);
  }
  return bytes;
}

int main(int argc, char **argv) {
  HrrContext *context = NULL, *failing = NULL, *none = NULL;
  HrrContextDesc context_desc;
  HrrContextInfo context_info;
  HrrCache *cache = NULL, *loaded = NULL;
  HrrBuildDesc build;
  HrrSegment segment;
  HrrCacheInfo cache_info;
  HrrLobe lobes[2];
  HrrQuery queries[QUERIES];
  HrrQueryOptions options;
  HrrHit *hits = malloc(CAPACITY * sizeof *hits);
  HrrCounters counters;
  HrrLobeFit fit;
  HrrCapture capture;
  uint64_t *offsets = malloc((QUERIES + 1) * sizeof *offsets);
  uint64_t count = 0, visited = 0, hash = 0, key;
  unsigned char *bytes = vertices(27);
  const double n[3] = {0, 0, 1}, wo[3] = {0.6, 0, 0.8}, bad[3] = {0, NAN, 1}, nowhere[3] = {0, 0, 0};
  double number = 0, offset[3];
  char path[4096], other[4096];
  int i;

  if (argc < 3) {
    return 2;
  }
  snprintf(path, sizeof path, "%s/every.cache", argv[1]);
  snprintf(other, sizeof other, "%s/every.capture", argv[1]);

  /* Versions and errors. */
  OK(hrr_check_abi(HRR_ABI));
  FAILS(hrr_check_abi(0), HRR_ERROR_ABI);
  REQUIRE(strlen(hrr_last_error()) > 0 && strstr(hrr_version_string(), "hrr ") != NULL);
  REQUIRE(hrr_version() == (HRR_VERSION_MAJOR << 16 | HRR_VERSION_MINOR << 8 | HRR_VERSION_PATCH));
  REQUIRE(strcmp(hrr_status_name(99), "unknown status") == 0);

  /* Contexts. */
  memset(&context_desc, 0, sizeof context_desc);
  FAILS(hrr_context_new(&context_desc, &context), HRR_ERROR_ABI);
  context_desc.struct_size = sizeof context_desc;
  context_desc.threads = 100000;
  BAD(hrr_context_new(&context_desc, &context));
  context_desc.threads = 2;
  BAD(hrr_context_new(&context_desc, NULL));
  context_desc.log = say;
  context_desc.log_level = HRR_LOG_INFO;
  context_desc.memory = memory;
  context_desc.parallel_for = never;
  OK(hrr_context_new(&context_desc, &failing));
  context_desc.parallel_for = in_turn;
  OK(hrr_context_new(&context_desc, &context));
  hrr_context_retain(context);
  hrr_context_release(context);
  hrr_context_retain(NULL);
  hrr_context_release(NULL);
  context_info.struct_size = 1;
  FAILS(hrr_context_info(context, &context_info), HRR_ERROR_ABI);
  context_info.struct_size = sizeof context_info;
  BAD(hrr_context_info(NULL, &context_info));
  OK(hrr_context_info(context, &context_info));
  REQUIRE(context_info.threads == 2 && context_info.bytes == 0);
  BAD(hrr_context_trim(NULL));
  OK(hrr_self_test(context, 5));
  BAD(hrr_self_test(NULL, 5));

  /* Caches. */
  memset(&segment, 0, sizeof segment);
  memset(&build, 0, sizeof build);
  segment.position = bytes + 1;
  segment.mask = (const uint32_t *)(const void *)(bytes + 1 + 12);
  segment.id = (const uint64_t *)(const void *)(bytes + 1 + 16);
  segment.position_stride = segment.mask_stride = segment.id_stride = 27;
  segment.count = VERTICES;
  build.segments = &segment;
  build.segment_count = 1;
  FAILS(hrr_cache_build(context, &build, &cache), HRR_ERROR_ABI);
  build.struct_size = sizeof build;
  BAD(hrr_cache_build(NULL, &build, &cache));
  BAD(hrr_cache_build(context, NULL, &cache));
  BAD(hrr_cache_build(context, &build, NULL));
  build.max_bytes = 1;
  FAILS(hrr_cache_build(context, &build, &cache), HRR_ERROR_OUT_OF_MEMORY);
  build.max_bytes = hrr_cache_estimate_bytes(VERTICES, 1);
  build.progress = stop;
  FAILS(hrr_cache_build(context, &build, &cache), HRR_ERROR_CANCELLED);
  build.progress = go_on;
  build.progress_user = &build;
  segment.count = UINT64_MAX;
  FAILS(hrr_cache_build(context, &build, &cache), HRR_ERROR_OUT_OF_MEMORY);
  segment.count = VERTICES;
  REQUIRE(cache == NULL);
  OK(hrr_cache_build(context, &build, &cache));
  REQUIRE(steps > 2 && messages > 2 && held > 0);
  hrr_cache_retain(cache);
  hrr_cache_release(cache);
  hrr_cache_retain(NULL);
  hrr_cache_release(NULL);
  cache_info.struct_size = sizeof cache_info;
  OK(hrr_cache_info(cache, &cache_info));
  REQUIRE(cache_info.vertex_count == VERTICES);
  BAD(hrr_cache_info(NULL, &cache_info));
  OK(hrr_cache_hash(cache, &hash));
  BAD(hrr_cache_hash(cache, NULL));
  OK(hrr_cache_validate(cache));
  BAD(hrr_cache_validate(NULL));
  OK(hrr_cache_save(cache, path));
  BAD(hrr_cache_save(cache, NULL));
  FAILS(hrr_cache_save(cache, "/none/there"), HRR_ERROR_IO);
  OK(hrr_cache_load(context, path, &loaded));
  BAD(hrr_cache_load(NULL, path, &loaded));
  FAILS(hrr_cache_load(context, argv[2], &loaded), HRR_ERROR_IO);
  OK(hrr_cache_hash(loaded, &key));
  REQUIRE(key == hash);
  OK(hrr_cache_offset(cache, n, wo, offset));
  FAILS(hrr_cache_offset(cache, bad, wo, offset), HRR_ERROR_NON_FINITE);
  BAD(hrr_cache_offset(cache, n, wo, NULL));

  /* Lobes. */
  OK(hrr_lobe_reflection(n, NULL, wo, 0.1, 0.2, 1, &lobes[0]));
  BAD(hrr_lobe_reflection(nowhere, NULL, wo, 0.1, 0.2, 1, &lobes[0]));
  FAILS(hrr_lobe_reflection(n, bad, wo, 0.1, 0.2, 1, &lobes[0]), HRR_ERROR_NON_FINITE);
  BAD(hrr_lobe_reflection(n, NULL, wo, 1.1, 0.2, 1, &lobes[0]));
  OK(hrr_lobe_transmission(n, wo, wo, 0.1, 0.2, 1.5, 1, &lobes[1]));
  BAD(hrr_lobe_transmission(n, wo, wo, 0.1, 0.2, 0, 1, &lobes[1]));
  FAILS(hrr_lobe_sphere(INFINITY, &lobes[1]), HRR_ERROR_NON_FINITE);
  OK(hrr_lobe_sphere(0.5, &lobes[1]));
  OK(hrr_lobe_eval(&lobes[0], wo, &number));
  REQUIRE(number > 0 && number <= 1);
  BAD(hrr_lobe_eval(NULL, wo, &number));
  OK(hrr_probability(lobes, 2, 0.01, wo, &number));
  BAD(hrr_probability(lobes, 9, 0.01, wo, &number));
  FAILS(hrr_probability(lobes, 2, NAN, wo, &number), HRR_ERROR_NON_FINITE);
  OK(hrr_constant_for(1, 4, VERTICES, &number));
  BAD(hrr_constant_for(-1, 4, VERTICES, &number));
  OK(hrr_check_lobe_fit(&lobes[0], wo, &number, 1, &fit));
  BAD(hrr_check_lobe_fit(&lobes[0], nowhere, &number, 1, &fit));

  /* Queries. */
  memset(queries, 0, sizeof queries);
  memset(&counters, 0, sizeof counters);
  memset(&options, 0, sizeof options);
  for (i = 0; i < QUERIES; i++) {
    queries[i].lobes = lobes;
    queries[i].lobe_count = 2;
    queries[i].mask = 7;
    queries[i].constant = 0.003;
    queries[i].key = hrr_key(1, 2, (uint64_t)i, 3);
  }
  FAILS(hrr_query(cache, &queries[0], &options, hits, CAPACITY, &count, &counters), HRR_ERROR_ABI);
  options.struct_size = sizeof options;
  for (i = 0; i < QUERIES; i++) {
    options.rule = (uint32_t)i % 3;
    options.brute_force = (uint32_t)i % 2;
    OK(hrr_query(cache, &queries[i], &options, hits, CAPACITY, &count, &counters));
    OK(hrr_query_visit(cache, &queries[i], &options, count_hits, &visited, NULL));
    FAILS(hrr_query(cache, &queries[i], &options, NULL, 0, &count, NULL),
          count > 0 ? HRR_ERROR_BUFFER_TOO_SMALL : HRR_OK);
  }
  REQUIRE(visited == counters.accepted && visited > 0);
  BAD(hrr_query(cache, NULL, NULL, hits, CAPACITY, &count, NULL));
  options.rule = 7;
  BAD(hrr_query(cache, &queries[0], &options, hits, CAPACITY, &count, NULL));
  queries[0].constant = 1e9;
  FAILS(hrr_query_visit(cache, &queries[0], NULL, refuse_hits, NULL, NULL), HRR_ERROR_CALLBACK);
  BAD(hrr_query_visit(cache, &queries[0], NULL, NULL, NULL, NULL));
  FAILS(hrr_query(cache, &queries[0], NULL, hits, 3, &count, NULL), HRR_ERROR_BUFFER_TOO_SMALL);
  REQUIRE(count == VERTICES / 4 * 3);
  queries[0].constant = 0.003;
  OK(hrr_query_batch(context, cache, queries, 0, QUERIES, NULL, hits, CAPACITY, offsets, &counters));
  FAILS(hrr_query_batch(context, cache, queries, 0, QUERIES, NULL, hits, 1, offsets, NULL), HRR_ERROR_BUFFER_TOO_SMALL);
  FAILS(hrr_query_batch(failing, cache, queries, 0, QUERIES, NULL, hits, CAPACITY, offsets, NULL), HRR_ERROR_CALLBACK);
  BAD(hrr_query_batch(context, cache, queries, 1, QUERIES, NULL, hits, CAPACITY, offsets, NULL));
  queries[7].position[1] = NAN;
  FAILS(hrr_query_batch(context, cache, queries, 0, QUERIES, NULL, hits, CAPACITY, offsets, NULL), HRR_ERROR_NON_FINITE);
  queries[7].position[1] = 0;

  /* Captures. */
  capture.struct_size = sizeof capture;
  FAILS(hrr_capture_end(context, &capture), HRR_ERROR_INVALID_STATE);
  FAILS(hrr_capture_begin(context, "/none/there", 0), HRR_ERROR_IO);
  OK(hrr_capture_begin(context, other, 0));
  FAILS(hrr_capture_begin(context, other, 0), HRR_ERROR_INVALID_STATE);
  OK(hrr_query_batch(context, loaded, queries, 0, QUERIES, NULL, hits, CAPACITY, offsets, NULL));
  OK(hrr_capture_end(context, &capture));
  REQUIRE(capture.caches == 1 && capture.queries == QUERIES);
  OK(hrr_capture_replay(context, other, &capture));
  REQUIRE(capture.queries == QUERIES && capture.differences == 0);
  FAILS(hrr_capture_replay(context, path, &capture), HRR_ERROR_IO);
  BAD(hrr_capture_replay(context, NULL, &capture));

  /* Rays. */
  {
    const float corners[9] = {-9, -9, 0.5f, 9, -9, 0.5f, 0, 9, 0.5f};
    const uint32_t indices[3] = {0, 1, 2}, wrong[3] = {0, 1, 3};
    HrrGeometry *geometry = NULL;
    HrrGeometryDesc desc;
    HrrMesh mesh;
    HrrRay ray;
    HrrRayHit hit;
    HrrLights lights;
    uint8_t *occluded = malloc(CAPACITY);
    memset(&desc, 0, sizeof desc);
    memset(&mesh, 0, sizeof mesh);
    mesh.position = corners;
    mesh.vertex_count = 3;
    mesh.index = wrong;
    mesh.triangle_count = 1;
    desc.meshes = &mesh;
    desc.mesh_count = 1;
    FAILS(hrr_geometry_build(context, &desc, &geometry), HRR_ERROR_ABI);
    desc.struct_size = sizeof desc;
    BAD(hrr_geometry_build(context, &desc, &geometry));
    mesh.index = indices;
    for (i = HRR_BACKEND_DEFAULT; i <= HRR_BACKEND_BRUTE; i++) {
      desc.backend = (uint32_t)i;
      if (i != HRR_BACKEND_EMBREE || strstr(hrr_version_string(), "embree") != NULL) {
        OK(hrr_geometry_build(context, &desc, &geometry));
        OK(hrr_ray_leave(geometry, nowhere, n, n, &ray));
        OK(hrr_intersect(geometry, &ray, 0, 1, &hit));
        REQUIRE(hit.mesh == 0 && hit.triangle == 0 && fabs(hit.t - 0.5) < 1e-5);
        OK(hrr_occluded(geometry, &ray, sizeof ray, 1, occluded));
        REQUIRE(occluded[0] == 1);
        ray.t_max = 0.4;
        OK(hrr_intersect(geometry, &ray, 0, 1, &hit));
        REQUIRE(hit.mesh == HRR_NO_HIT);
        ray.origin[0] = NAN;
        FAILS(hrr_intersect(geometry, &ray, 0, 1, &hit), HRR_ERROR_NON_FINITE);
        memset(&lights, 0, sizeof lights);
        lights.struct_size = sizeof lights;
        lights.position = bytes + 1;
        lights.position_stride = 27;
        lights.count = VERTICES;
        lights.first_id = 1000;
        OK(hrr_query(cache, &queries[1], NULL, hits, CAPACITY, &count, NULL));
        OK(hrr_occluded_hits(geometry, queries[1].position, NULL, &lights, hits, count, occluded));
        OK(hrr_query_visible(cache, geometry, &queries[1], NULL, n, &lights, hits, CAPACITY, &count, NULL));
        lights.count = 1;
        BAD(hrr_query_visible(cache, geometry, &queries[1], NULL, n, &lights, hits, CAPACITY, &count, NULL));
        hrr_geometry_retain(geometry);
        hrr_geometry_release(geometry);
        hrr_geometry_release(geometry);
      }
    }
    free(occluded);
  }

  /* Scenes and renders. */
  {
    HrrSetting settings[2] = {{"film.width", "16"}, {"film.height", "12"}}, fast[2] = {{"iterations", "1"}, {"visibility", "obvhs"}};
    HrrScene *scene = NULL;
    HrrSceneInfo info;
    HrrRender *render = NULL;
    HrrRenderDesc desc;
    HrrRenderInfo done;
    const char *text = NULL;
    float *rgb = malloc(16 * 12 * 3 * sizeof *rgb);
    BAD(hrr_scene_load(NULL, argv[2], settings, 2, &scene));
    FAILS(hrr_scene_load(context, path, settings, 2, &scene), HRR_ERROR_IO);
    OK(hrr_scene_load(context, argv[2], settings, 2, &scene));
    info.struct_size = sizeof info;
    OK(hrr_scene_info(scene, &info));
    REQUIRE(info.width == 16 && info.height == 12);
    BAD(hrr_scene_warning(scene, info.warning_count, &text));
    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.settings = settings;
    desc.setting_count = 2;
    BAD(hrr_render(context, scene, &desc, &render));
    desc.settings = fast;
    desc.progress = go_on;
    desc.progress_user = &desc;
    OK(hrr_render(context, scene, &desc, &render));
    done.struct_size = sizeof done;
    OK(hrr_render_info(render, &done));
    REQUIRE(done.iterations == 1);
    OK(hrr_render_pixels(render, rgb, 16 * 12 * 3));
    FAILS(hrr_render_pixels(render, rgb, 16 * 12), HRR_ERROR_BUFFER_TOO_SMALL);
    OK(hrr_render_stats(render, &text));
    REQUIRE(strstr(text, "iterations") != NULL);
    snprintf(path, sizeof path, "%s/every.png", argv[1]);
    OK(hrr_render_write(render, path));
    FAILS(hrr_render_write(render, other), HRR_ERROR_IO);
    hrr_scene_retain(scene);
    hrr_scene_release(scene);
    hrr_scene_release(scene);
    hrr_render_retain(render);
    hrr_render_release(render);
    hrr_render_release(render);
    free(rgb);
  }

  OK(hrr_context_trim(context));
  hrr_context_release(context);
  hrr_context_release(failing);
  hrr_context_release(none);
  /* Caches outlive their context. */
  OK(hrr_query(cache, &queries[1], NULL, hits, CAPACITY, &count, NULL));
  hrr_cache_release(loaded);
  hrr_cache_release(cache);
  REQUIRE(held == 0);
  free(bytes);
  free(hits);
  free(offsets);
  puts("all is well");
  return 0;
}
