/* The least a host does: a cache of light vertices, a query at an eye vertex, a sum over what is accepted.
 *
 * The sum of 1/P over the accepted vertices estimates the number of all vertices, without bias: that is the check. */
#include "hrr.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { VERTICES = 20000, QUERIES = 2000, CAPACITY = 4096 };

/* A light vertex as renderers have them: a position among other things. */
typedef struct Vertex {
  float throughput[3];
  float position[3];
  int depth;
} Vertex;

static void check(HrrStatus status) {
  if (status != HRR_OK) {
    fprintf(stderr, "%s: %s\n", hrr_status_name(status), hrr_last_error());
    exit(1);
  }
}

static float uniform(uint64_t *state) {
  *state = *state * 6364136223846793005u + 1442695040888963407u;
  return (float)(*state >> 40) * (1.0f / 16777216.0f);
}

int main(void) {
  static Vertex vertices[VERTICES];
  static HrrHit hits[CAPACITY];
  HrrContext *context = NULL;
  HrrCache *cache = NULL;
  HrrSegment segment;
  HrrBuildDesc desc;
  HrrCacheInfo info;
  HrrLobe lobes[2];
  HrrQuery query;
  HrrCounters counters;
  uint64_t state = 1, i, k, count;
  double sum = 0.0, accepted = 0.0;
  const double normal[3] = {0, 0, 1}, wo[3] = {0.6, 0, 0.8};

  check(hrr_check_abi(HRR_ABI));
  check(hrr_context_new(NULL, &context));
  check(hrr_self_test(context, 1));

  /* Light vertices on the ceiling of a box of size 2. */
  for (i = 0; i < VERTICES; i++) {
    vertices[i].position[0] = 2 * uniform(&state) - 1;
    vertices[i].position[1] = 2 * uniform(&state) - 1;
    vertices[i].position[2] = 1;
  }
  memset(&segment, 0, sizeof segment);
  segment.position = vertices[0].position;
  segment.position_stride = sizeof(Vertex);
  segment.count = VERTICES;
  memset(&desc, 0, sizeof desc);
  desc.struct_size = sizeof desc;
  desc.segments = &segment;
  desc.segment_count = 1;
  check(hrr_cache_build(context, &desc, &cache));
  info.struct_size = sizeof info;
  check(hrr_cache_info(cache, &info));

  /* An eye vertex on the floor: a glossy lobe on a diffuse one. */
  check(hrr_lobe_reflection(normal, NULL, wo, 0.05, 0.05, 1.0, &lobes[0]));
  check(hrr_lobe_sphere(0.3, &lobes[1]));
  memset(&query, 0, sizeof query);
  query.lobes = lobes;
  query.lobe_count = 2;
  query.mask = 0xffffffffu;
  check(hrr_constant_for(10, 24, info.vertex_count, &query.constant));
  memset(&counters, 0, sizeof counters);
  for (i = 0; i < QUERIES; i++) {
    query.key = hrr_key(7, 0, i, 1);
    check(hrr_query(cache, &query, NULL, hits, CAPACITY, &count, &counters));
    for (k = 0; k < count; k++) {
      double light[3], offset[3], p;
      int axis;
      for (axis = 0; axis < 3; axis++) {
        light[axis] = vertices[hits[k].id].position[axis];
      }
      /* Any edge's probability, for weights: the number that the query used, to the last bit. */
      check(hrr_cache_offset(cache, light, query.position, offset));
      check(hrr_probability(lobes, 2, query.constant, offset, &p));
      if (!(p == hits[k].probability)) {
        fprintf(stderr, "the probability is %.17g, the query's %.17g\n", p, hits[k].probability);
        return 1;
      }
      /* Here a host evaluates its BSDFs, casts a shadow ray, weights, and divides by P and by its light paths. */
      sum += 1.0 / hits[k].probability;
    }
    accepted += (double)count;
  }
  printf("%u light vertices; %.1f accepted and %.0f of %.0f tested per query; estimated number %.0f\n",
         (unsigned)info.vertex_count, accepted / QUERIES, (double)counters.leaves / QUERIES,
         (double)info.vertex_count, sum / QUERIES);
  hrr_cache_release(cache);
  hrr_context_release(context);
  if (fabs(sum / QUERIES / VERTICES - 1) > 0.05) {
    fprintf(stderr, "the estimate is off\n");
    return 1;
  }
  puts("all is well");
  return 0;
}
