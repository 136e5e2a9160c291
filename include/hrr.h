/* hrr.h - the C interface of libhrr: hierarchical Russian roulette for vertex connections.
 *
 * Made from src/ffi; docs/c-api.md tells how to use it. C99 and C++11; include hrr.hpp for C++.
 *
 * Units are the host's. Outputs are written when a call succeeds (or where said otherwise). Structs are zeroed by the
 * host before their fields are set. Arguments may not be NULL where nothing is said.
 */

#ifndef HRR_H
#define HRR_H

#include <stddef.h>
#include <stdint.h>
#define HRR_VERSION_MAJOR 0
#define HRR_VERSION_MINOR 1
#define HRR_VERSION_PATCH 0

/* Define it where functions need an attribute, such as __declspec(dllimport). */
#ifndef HRR_API
#define HRR_API
#endif

// The interface that this header describes; for hrr_check_abi.
#define HRR_ABI 1

// Positions are three floats.
#define HRR_FLOAT3 0

// Positions are three doubles. They are stored as floats relative to the centre of their bounding box.
#define HRR_DOUBLE3 1

// A position that is NaN, infinite or (double) beyond 1e38 is an error.
#define HRR_INVALID_ERROR 0

// Vertices with such a position are left out, and counted in HrrCacheInfo.
#define HRR_INVALID_DROP 1

// Vertices are taken in the order of the segments: the tree depends on it.
#define HRR_ORDER_AS_GIVEN 0

// Vertices are sorted by id first, so that segments may be filled by threads in any order; ids must differ.
#define HRR_ORDER_BY_ID 1

// Most lobes of one query.
#define HRR_MAX_LOBES 8

// Children of equal size get one stratum each: the default, and the fastest.
#define HRR_RULE_NESTED 0

// The rule of the paper.
#define HRR_RULE_SEMI_STRATIFIED 1

// The true minimum of independent numbers: independent roulettes. Slower; for comparison.
#define HRR_RULE_EXACT 2

// Light vertices in a tree. Immutable: any number of threads may query it at once. Opaque; see hrr_cache_build.
typedef struct HrrCache HrrCache;

// Threads and spare memory. May be used from any thread, by several at once. Opaque; see hrr_context_new.
typedef struct HrrContext HrrContext;

// What a call returns: HRR_OK or one of HRR_ERROR_*. An integer, so that numbers of later versions stay defined.
typedef int32_t HrrStatus;

// A task of hrr_query_batch: call it once for each index, from any thread, all before parallel_for returns.
typedef void (*HrrTaskFn)(void *task_data, uint32_t index);

// The host's way to run tasks on its own threads: calls task(task_data, i) once for each i in [0, count), in any
// order, at the same time or one after the other, and returns when all of them have ended. Must not throw.
typedef void (*HrrParallelForFn)(void *user, uint32_t count, HrrTaskFn task, void *task_data);

// How to make a context. Zero it, then set struct_size and what is wanted.
typedef struct HrrContextDesc {
  // sizeof(HrrContextDesc).
  uint32_t struct_size;
  // Threads of the context's own pool, for builds and batches: 0 = one for each processor.
  uint32_t threads;
  // The host's threads, for batches in place of the pool; NULL = none. Builds always use the pool.
  HrrParallelForFn parallel_for;
  // Passed to parallel_for.
  void *parallel_user;
} HrrContextDesc;

// Light vertices in a host's memory, such as one thread's or one light path's. Nothing needs to be aligned; nothing
// is read behind the last element; nothing is referred to after the build.
typedef struct HrrSegment {
  // The first position: three floats or three doubles, in the host's unit of length.
  const void *position;
  // Bytes from one position to the next; 0 = packed.
  size_t position_stride;
  // The first vertex' mask (light groups, path depth, medium, ...); NULL = all bits set. A query passes over
  // vertices whose mask shares no bit with its own.
  const uint32_t *mask;
  // Bytes from one mask to the next; 0 = packed.
  size_t mask_stride;
  // The first vertex' id, which hits report; NULL = first_id + i for vertex i.
  const uint64_t *id;
  // Bytes from one id to the next; 0 = packed.
  size_t id_stride;
  // Number of vertices; 0 is fine.
  uint64_t count;
  // Id of the first vertex where id is NULL.
  uint64_t first_id;
} HrrSegment;

// What to build a cache from. Zero it, then set struct_size and what is wanted.
typedef struct HrrBuildDesc {
  // sizeof(HrrBuildDesc).
  uint32_t struct_size;
  // HRR_FLOAT3 or HRR_DOUBLE3.
  uint32_t position_format;
  // The light vertices.
  const struct HrrSegment *segments;
  // Number of segments; 0 makes an empty cache.
  uint32_t segment_count;
  // HRR_INVALID_ERROR or HRR_INVALID_DROP.
  uint32_t invalid;
  // HRR_ORDER_AS_GIVEN or HRR_ORDER_BY_ID.
  uint32_t order;
  // 0.
  uint32_t reserved;
  // Fail rather than need more memory than this, in bytes, by hrr_cache_estimate_bytes; 0 = no limit.
  uint64_t max_bytes;
} HrrBuildDesc;

// What there is to know about a cache. Set struct_size before the call.
typedef struct HrrCacheInfo {
  // sizeof(HrrCacheInfo).
  uint32_t struct_size;
  // Levels of the tree, whose nodes have eight children; 0 when it is empty.
  uint32_t levels;
  // Light vertices in the tree.
  uint64_t vertex_count;
  // Light vertices left out by HRR_INVALID_DROP.
  uint64_t dropped_count;
  // Memory of the cache in bytes, buffers for the next build included.
  uint64_t bytes;
  // What stored positions are relative to: 0 for HRR_FLOAT3, the centre of the box for HRR_DOUBLE3.
  double origin[3];
  // Lower corner of the box around the stored positions, in the host's coordinates; 0 when empty.
  double bounds_min[3];
  // Upper corner.
  double bounds_max[3];
  // Time that the build took, in seconds.
  double build_seconds;
} HrrCacheInfo;

// A squared ellipsoidal lobe, `weight` times K, by which light vertices are judged: plain data, made by hrr_lobe_* or
// by the host. K is 1 on the axis z.
typedef struct HrrLobe {
  // First tangent; unit length, perpendicular to y and z (1e-3 is forgiven).
  double x[3];
  // Second tangent.
  double y[3];
  // The lobe's axis, in the host's world space.
  double z[3];
  // The lobe's own roughness along x, in (0,1]: about half the GGX roughness whose reflection it stands for. 1 on
  // both axes makes a sphere.
  double alpha_x;
  // The same along y.
  double alpha_y;
  // BSDF times |cos| on the axis, 1/sr, at least 0.
  double weight;
} HrrLobe;

// What is asked at an eye vertex.
typedef struct HrrQuery {
  // The eye vertex, in the coordinates of the light vertices.
  double position[3];
  // The lobes whose sum judges directions.
  const struct HrrLobe *lobes;
  // Their number, at most HRR_MAX_LOBES; with none nothing is accepted.
  uint32_t lobe_count;
  // Only light vertices that share a bit with it are looked at; 0xffffffff = all; not 0. Moves no random number.
  uint32_t mask;
  // C, an area in the host's unit of length squared: see hrr_constant_for.
  double constant;
  // Key of the random numbers: different for each eye vertex and iteration; see hrr_key.
  uint64_t key;
} HrrQuery;

// How to query. Zero it, then set struct_size and what is wanted; NULL in its place means the defaults.
typedef struct HrrQueryOptions {
  // sizeof(HrrQueryOptions).
  uint32_t struct_size;
  // HRR_RULE_*: how the random numbers of a subtree are dealt. All are unbiased.
  uint32_t rule;
  // 1: test every vertex. The same hits as with the tree, to the last bit, in the same order.
  uint32_t brute_force;
  // 0.
  uint32_t reserved;
} HrrQueryOptions;

// An accepted light vertex.
typedef struct HrrHit {
  // The light vertex' id.
  uint64_t id;
  // The probability P with which it was accepted, in (0,1]: divide by it.
  double probability;
} HrrHit;

// What queries did. Calls add to it: zero it first.
typedef struct HrrCounters {
  // Queries.
  uint64_t queries;
  // Nodes visited, each of up to eight boxes or vertices.
  uint64_t nodes;
  // Boxes and vertices tested against a range.
  uint64_t tests;
  // Light vertices whose probability was computed.
  uint64_t leaves;
  // Light vertices accepted.
  uint64_t accepted;
  // Sum of the probabilities of those `leaves`: a lower bound of the expected number of accepted vertices, equal
  // to it with brute_force.
  double expected;
} HrrCounters;

// Called for each accepted vertex; anything but 0 makes it the last. Must not throw.
typedef int32_t (*HrrHitFn)(void *user, const struct HrrHit *hit);

// How a host's BSDF compares with a lobe: ratios of f |cos| to weight * K. A wrong convention of roughness or a wrong
// frame shows in them at once.
typedef struct HrrLobeFit {
  // Directions compared: those with a lobe above 0.
  uint64_t count;
  // Mean ratio.
  double mean;
  // Least ratio.
  double min;
  // Greatest ratio. Where it is large, connections are rarely tried that matter: fireflies.
  double max;
  // The direction of the greatest ratio, an index.
  uint64_t worst;
} HrrLobeFit;

// The call did what it says.
#define HRR_OK 0

// An argument is NULL, out of its range or contradicts another.
#define HRR_ERROR_INVALID_ARGUMENT 1

// An input is NaN, infinite, or too large for single precision; the message names it.
#define HRR_ERROR_NON_FINITE 3

// The memory is not there, or max_bytes does not allow it.
#define HRR_ERROR_OUT_OF_MEMORY 4

// The results do not fit; the number that would is written. The same call again gives the same results.
#define HRR_ERROR_BUFFER_TOO_SMALL 6

// Header and library do not belong together, or a struct_size is none.
#define HRR_ERROR_ABI 7

// A function of the host asked to stop, or did not do its work.
#define HRR_ERROR_CALLBACK 9

// A bug in this library, caught at its border.
#define HRR_ERROR_PANIC 10

// Something below failed (threads), or the self-test found a difference.
#define HRR_ERROR_INTERNAL 11

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The library's version: major << 16 | minor << 8 | patch. Any thread.
HRR_API uint32_t hrr_version(void);

// The library's version as text. Static: never freed. Any thread.
HRR_API const char *hrr_version_string(void);

// HRR_OK when the library serves the interface of the header; call hrr_check_abi(HRR_ABI) first. Any thread.
//
// Errors: HRR_ERROR_ABI.
HRR_API HrrStatus hrr_check_abi(uint32_t header_abi);

// A status' name, as in this header; "unknown status" for others. Static: never freed. Any thread.
HRR_API const char *hrr_status_name(HrrStatus status);

// What went wrong in this thread's last call that failed, in English; "" when none has. Calls that succeed leave it
// alone. Valid until this thread's next call that fails; never freed by the host.
HRR_API
const char *hrr_last_error(void);

// Makes a context with one reference, which hrr_context_release gives up. desc: NULL for the defaults. It starts the
// threads of its pool, which sleep until there is work. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI, HRR_ERROR_INTERNAL (no threads to be had).
HRR_API
HrrStatus hrr_context_new(const struct HrrContextDesc *desc,
                          struct HrrContext **out_context);

// Adds a reference; NULL is allowed. Any thread.
HRR_API void hrr_context_retain(struct HrrContext *context);

// Gives up a reference; the last one ends the context's threads and waits for that. NULL is allowed. Caches live on without their
// context. Any thread.
HRR_API
void hrr_context_release(struct HrrContext *context);

// Frees the memory that the context keeps for its next build. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT.
HRR_API HrrStatus hrr_context_trim(const struct HrrContext *context);

// An upper bound of the bytes that building and keeping a cache of so many vertices takes, beside the host's own.
// masked: whether there are masks. A pure function; any thread.
HRR_API
uint64_t hrr_cache_estimate_bytes(uint64_t vertex_count,
                                  uint32_t masked);

// Builds a cache with one reference, which hrr_cache_release gives up. Blocks until the tree is built, by the
// context's pool; the tree is the same for any number of threads. Memory of a cache released before is used again.
// Afterwards nothing of the host's is referred to. Any thread; other caches may be built and queried meanwhile.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE, HRR_ERROR_OUT_OF_MEMORY, HRR_ERROR_ABI; *out_cache is
// then as it was.
HRR_API
HrrStatus hrr_cache_build(const struct HrrContext *context,
                          const struct HrrBuildDesc *desc,
                          struct HrrCache **out_cache);

// Adds a reference; NULL is allowed. Any thread.
HRR_API void hrr_cache_retain(struct HrrCache *cache);

// Gives up a reference; the last one frees the cache, or leaves its memory to the context's next build. NULL is
// allowed. Any thread.
HRR_API
void hrr_cache_release(struct HrrCache *cache);

// Describes a cache. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI.
HRR_API HrrStatus hrr_cache_info(const struct HrrCache *cache, struct HrrCacheInfo *info);

// A fingerprint of what queries can see: positions, ids and masks in tree order. Equal builds have equal ones, on
// every machine. Reads the whole cache. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT.
HRR_API
HrrStatus hrr_cache_hash(const struct HrrCache *cache,
                         uint64_t *out_hash);

// The offset (light - eye) by which queries at `eye` judge a light vertex at `light`: the light's position rounded as
// this cache stores it. What hrr_probability makes of it is, to the last bit, what such a query would divide by; for
// the weights of edges that no query was made for. light, eye, out_offset: 3 numbers each. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
HRR_API
HrrStatus hrr_cache_offset(const struct HrrCache *cache,
                           const double *light,
                           const double *eye,
                           double *out_offset);

// The lobe of GGX reflection at an eye vertex: around the direction that wo is mirrored to.
//
// normal: shading normal, either side. tangent: the direction that alpha_x goes along; NULL where the roughness is the
// same all round. wo: towards the previous eye vertex. 3 numbers each, of unit length, world space. alpha_x, alpha_y:
// GGX roughness alpha (not its root), from 0 to 1. reflectance: Fresnel factor, or how much of this lobe is wanted,
// from 0 to 1; the lobe's weight is proportional to it and may be replaced. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
HRR_API
HrrStatus hrr_lobe_reflection(const double *normal,
                              const double *tangent,
                              const double *wo,
                              double alpha_x,
                              double alpha_y,
                              double reflectance,
                              struct HrrLobe *out_lobe);

// The lobe of GGX transmission at an eye vertex: around the direction that wo is refracted to. As
// hrr_lobe_reflection, and eta: index of refraction behind the surface over that on wo's side, in [1e-3, 1e3]. The
// weight is that of importance; radiance sees 1 / eta^2 of it, which the host may put in its place. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
HRR_API
HrrStatus hrr_lobe_transmission(const double *normal,
                                const double *tangent,
                                const double *wo,
                                double alpha_x,
                                double alpha_y,
                                double eta,
                                double transmittance,
                                struct HrrLobe *out_lobe);

// The lobe that is the same in all directions, of the given weight (1/sr, at least 0): for diffuse reflection, and as
// a floor under another lobe. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
HRR_API
HrrStatus hrr_lobe_sphere(double weight,
                          struct HrrLobe *out_lobe);

// K of a lobe in a direction (3 numbers, of any length but 0), without the weight: in (0,1], 1 on the axis. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
HRR_API
HrrStatus hrr_lobe_eval(const struct HrrLobe *lobe,
                        const double *direction,
                        double *out_k);

// P = min(1, constant * sum of weight_i K_i(w) / d^2) of a light vertex at an offset (light - eye, 3 numbers, the
// host's unit of length) from an eye vertex. A pure function: for weights of any edge, whether or not a query was made.
// To the last bit what a query divides by, given an offset from hrr_cache_offset. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
HRR_API
HrrStatus hrr_probability(const struct HrrLobe *lobes,
                          uint32_t lobe_count,
                          double constant,
                          const double *offset,
                          double *out_probability);

// The constant C with which a query accepts about `wanted` light vertices while its probabilities stay below 1:
// wanted * area / vertex_count, an area. area: the scene's surface (or what of it light reaches), in the host's unit of
// length squared. vertex_count: of the cache; an estimate that is the same for all iterations keeps iterations
// independent. 0 when it is 0. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
HRR_API
HrrStatus hrr_constant_for(double wanted,
                           double area,
                           uint64_t vertex_count,
                           double *out_constant);

// Key of a query's random numbers, well mixed, for a seed, an iteration (or sample), a pixel and a depth (with which
// of several queries there, if there are several). Any numbers will do that no two queries share. Any thread.
HRR_API
uint64_t hrr_key(uint64_t seed,
                 uint64_t iteration,
                 uint64_t pixel,
                 uint64_t depth);

// Writes the accepted light vertices to hits (room for capacity) and their number to *out_count, which may be more:
// then the first `capacity` are there and the status is HRR_ERROR_BUFFER_TOO_SMALL. hits may be NULL when capacity is
// 0. options, counters: NULL if not wanted.
//
// The same key and cache give the same hits in the same order, on any thread and machine. Any thread; takes no lock,
// and allocates nothing unless it fails.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE, HRR_ERROR_ABI, HRR_ERROR_BUFFER_TOO_SMALL.
HRR_API
HrrStatus hrr_query(const struct HrrCache *cache,
                    const struct HrrQuery *query,
                    const struct HrrQueryOptions *options,
                    struct HrrHit *hits,
                    uint64_t capacity,
                    uint64_t *out_count,
                    struct HrrCounters *counters);

// Calls a function with each accepted light vertex, on this thread, in the order of hrr_query. options, counters: NULL
// if not wanted. Any thread; takes no lock, and allocates nothing unless it fails.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE, HRR_ERROR_ABI, HRR_ERROR_CALLBACK (visit returned
// something but 0; counters are left alone).
HRR_API
HrrStatus hrr_query_visit(const struct HrrCache *cache,
                          const struct HrrQuery *query,
                          const struct HrrQueryOptions *options,
                          HrrHitFn visit,
                          void *user,
                          struct HrrCounters *counters);

// Answers query_count queries, which lie query_stride bytes apart (0 = packed), on the threads of the context or of
// its parallel_for. The hits of query i, as hrr_query would write them, lie from entry i of offsets up to entry i + 1.
// hits: room for hit_capacity, NULL when that is 0. offsets: room for query_count + 1.
//
// When there are more hits than fit, hits is left alone, offsets is written, its last entry says how many there are,
// and the status is HRR_ERROR_BUFFER_TOO_SMALL. options, counters: NULL if not wanted. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE, HRR_ERROR_ABI, HRR_ERROR_BUFFER_TOO_SMALL,
// HRR_ERROR_CALLBACK (parallel_for did not run all tasks). Of several queries at fault the first is named.
HRR_API
HrrStatus hrr_query_batch(const struct HrrContext *context,
                          const struct HrrCache *cache,
                          const struct HrrQuery *queries,
                          size_t query_stride,
                          uint64_t query_count,
                          const struct HrrQueryOptions *options,
                          struct HrrHit *hits,
                          uint64_t hit_capacity,
                          uint64_t *offsets,
                          struct HrrCounters *counters);

// Compares a lobe with a host's BSDF at some directions. directions: 3 numbers each, packed, of any length but 0.
// f_cos: BSDF times |cos| for each, 1/sr, at least 0. count: at least 1. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT (also when the lobe is 0 in all directions), HRR_ERROR_NON_FINITE.
HRR_API
HrrStatus hrr_check_lobe_fit(const struct HrrLobe *lobe,
                             const double *directions,
                             const double *f_cos,
                             uint64_t count,
                             struct HrrLobeFit *out_fit);

// Builds a cache and queries it, in all modes, against brute force: shows that the library does on this machine what
// it does elsewhere. Some 10 milliseconds. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_INTERNAL (a difference; the message says where).
HRR_API
HrrStatus hrr_self_test(const struct HrrContext *context,
                        uint64_t seed);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* HRR_H */
