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

// Nothing is said.
#define HRR_LOG_OFF 0

// What went wrong without a call that could say so.
#define HRR_LOG_ERROR 1

// What hosts and users should know: light vertices left out, remarks on scene files.
#define HRR_LOG_WARNING 2

// What was done: builds, renders, with figures.
#define HRR_LOG_INFO 3

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

// Embree where the library was built with it, else obvhs.
#define HRR_BACKEND_DEFAULT 0

// Intel Embree.
#define HRR_BACKEND_EMBREE 1

// The tree of the Rust crate obvhs.
#define HRR_BACKEND_OBVHS 2

// Every triangle for every ray: for comparison.
#define HRR_BACKEND_BRUTE 3

// `mesh` of an HrrRayHit where a ray hits nothing.
#define HRR_NO_HIT 4294967295

// Light vertices in a tree. Immutable: any number of threads may query it at once. Opaque; see hrr_cache_build.
typedef struct HrrCache HrrCache;

// Threads and spare memory. May be used from any thread, by several at once. Opaque; see hrr_context_new.
typedef struct HrrContext HrrContext;

// Triangles in a tree. Immutable: any number of threads may cast rays at once. Opaque; see hrr_geometry_build.
typedef struct HrrGeometry HrrGeometry;

// A render that is finished. Immutable. Opaque; see hrr_render.
typedef struct HrrRender HrrRender;

// A scene that was loaded. Immutable. Opaque; see hrr_scene_load.
typedef struct HrrScene HrrScene;

// Whom to tell.
typedef struct Progress Progress;

// What a call returns: HRR_OK or one of HRR_ERROR_*. An integer, so that numbers of later versions stay defined.
typedef int32_t HrrStatus;

// A task of hrr_query_batch: call it once for each index, from any thread, all before parallel_for returns.
typedef void (*HrrTaskFn)(void *task_data, uint32_t index);

// The host's way to run tasks on its own threads: calls task(task_data, i) once for each i in [0, count), in any
// order, at the same time or one after the other, and returns when all of them have ended. Must not throw.
typedef void (*HrrParallelForFn)(void *user, uint32_t count, HrrTaskFn task, void *task_data);

// Takes a message (one sentence in UTF-8, valid during the call) of a level, one of HRR_LOG_*. Called by any thread, by
// several at once. Must not throw.
typedef void (*HrrLogFn)(void *user, uint32_t level, const char *message);

// Told before memory is taken (bytes above 0: an upper bound; anything but 0 refuses, and the call fails with
// HRR_ERROR_OUT_OF_MEMORY) and after it is given back (bytes below 0; the answer is not looked at). The sum of all
// bytes not refused is what the context's caches hold, with the memory kept for the next build. Called by the threads
// that build and release, by several at once, until the context and its caches are released. Must not throw.
typedef int32_t (*HrrMemoryFn)(void *user, int64_t bytes);

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
  // Where messages go; NULL = nowhere.
  HrrLogFn log;
  // Passed to log.
  void *log_user;
  // HRR_LOG_*: the highest level that is said; 0 = nothing.
  uint32_t log_level;
  // 0.
  uint32_t reserved;
  // Asked for memory; NULL = nobody is.
  HrrMemoryFn memory;
  // Passed to memory.
  void *memory_user;
} HrrContextDesc;

// What a context holds. Set struct_size before the call.
typedef struct HrrContextInfo {
  // sizeof(HrrContextInfo).
  uint32_t struct_size;
  // Threads of the pool.
  uint32_t threads;
  // Bytes that the context's caches hold, with the memory kept for the next build. Geometry and scenes are not
  // counted.
  uint64_t bytes;
  // The most that `bytes` ever was, by upper bounds while builds went on.
  uint64_t peak_bytes;
} HrrContextInfo;

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

// Told how much is done, from 0 to 1; anything but 0 ends the call. Called now and then by one thread at a time, which
// need not be the caller's. Must not throw.
typedef int32_t (*HrrProgressFn)(void *user, double done);

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
  // Told how far the build is; NULL = nobody is. What it returns ends the build with HRR_ERROR_CANCELLED, before the
  // tree is begun or after; gathering looks often, the tree itself not.
  HrrProgressFn progress;
  // Passed to progress.
  void *progress_user;
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

// What is in the file of a capture. Set struct_size before the call.
typedef struct HrrCapture {
  // sizeof(HrrCapture).
  uint32_t struct_size;
  // 0.
  uint32_t reserved;
  // Caches.
  uint64_t caches;
  // Queries.
  uint64_t queries;
  // Queries that were left out for want of room, or after an error.
  uint64_t left_out;
  // Size of the file.
  uint64_t bytes;
  // Queries whose hits were others when they were made again.
  uint64_t differences;
  // Time that these queries took, in seconds.
  double seconds;
} HrrCapture;

// A triangle mesh in a host's memory. Nothing needs to be aligned; nothing is referred to after the build.
typedef struct HrrMesh {
  // The first vertex' position: three floats or three doubles (HrrGeometryDesc), in the host's unit of length.
  const void *position;
  // Bytes from one position to the next; 0 = packed.
  size_t position_stride;
  // Number of vertices.
  uint64_t vertex_count;
  // The first triangle's three vertices.
  const uint32_t *index;
  // Bytes from one triangle to the next; 0 = packed, 12.
  size_t index_stride;
  // Number of triangles.
  uint64_t triangle_count;
} HrrMesh;

// What to build geometry from. Zero it, then set struct_size and what is wanted.
typedef struct HrrGeometryDesc {
  // sizeof(HrrGeometryDesc).
  uint32_t struct_size;
  // HRR_FLOAT3 or HRR_DOUBLE3 (stored as floats relative to the centre of the box around all meshes).
  uint32_t position_format;
  // The meshes. All backends keep the triangles in an order and scale of their own: they are copied.
  const struct HrrMesh *meshes;
  // Number of meshes.
  uint32_t mesh_count;
  // HRR_BACKEND_*.
  uint32_t backend;
} HrrGeometryDesc;

// A ray. Hits lie in t_min < t < t_max. Numbers are rounded to single precision, the origin relative to the geometry's.
typedef struct HrrRay {
  // Start.
  double origin[3];
  // Direction, of any length; distances are in units of it.
  double direction[3];
  // Nearest distance that counts, at least 0.
  double t_min;
  // Farthest distance that counts; may be infinite.
  double t_max;
} HrrRay;

// What a ray hits first.
typedef struct HrrRayHit {
  // Mesh, HRR_NO_HIT when there is none: the other fields are 0 then.
  uint32_t mesh;
  // Triangle of the mesh.
  uint32_t triangle;
  // Weight of the triangle's second corner.
  float u;
  // Weight of the triangle's third corner.
  float v;
  // Distance in units of the ray's direction.
  float t;
} HrrRayHit;

// Light vertices as rays see them. Nothing needs to be aligned.
typedef struct HrrLights {
  // sizeof(HrrLights).
  uint32_t struct_size;
  // HRR_FLOAT3 or HRR_DOUBLE3: of positions and of normals.
  uint32_t format;
  // Position of the light vertex with id first_id.
  const void *position;
  // Bytes from one position to the next; 0 = packed.
  size_t position_stride;
  // Its geometric normal, of any length and either side, 0 for a vertex on no surface; NULL = all on none.
  const void *normal;
  // Bytes from one normal to the next; 0 = packed.
  size_t normal_stride;
  // Number of light vertices.
  uint64_t count;
  // Id of the first one; that of light vertex i is first_id + i.
  uint64_t first_id;
} HrrLights;

// A setting: for scenes a key of the TOML file with dots ("camera.fov_y", "material.mirror.alpha"), for renders the name
// of a setting ("iterations", "integrator"; `hrr render --help` lists them).
typedef struct HrrSetting {
  // The key; UTF-8.
  const char *name;
  // The value as a scene file or the command line has it: "30", "[1e-3, 1e-3]", "lvc+hrr".
  const char *value;
} HrrSetting;

// What there is to know about a scene. Set struct_size before the call.
typedef struct HrrSceneInfo {
  // sizeof(HrrSceneInfo).
  uint32_t struct_size;
  // Pixels across.
  uint32_t width;
  // Pixels down.
  uint32_t height;
  // Remarks of the loader; see hrr_scene_warning.
  uint32_t warning_count;
  // Triangles.
  uint64_t triangle_count;
  // Fingerprint of all files and settings, the same on every machine.
  uint64_t hash;
} HrrSceneInfo;

// How to render. Zero it, then set struct_size and what is wanted.
typedef struct HrrRenderDesc {
  // sizeof(HrrRenderDesc).
  uint32_t struct_size;
  // Number of settings.
  uint32_t setting_count;
  // Settings in place of the scene's; NULL when there are none. Without "threads" a render has as many as the
  // context's pool.
  const struct HrrSetting *settings;
  // Told how far the render is; NULL = nobody is. What it returns ends the render after the iteration that goes on;
  // the call then succeeds, with the image so far.
  HrrProgressFn progress;
  // Passed to progress.
  void *progress_user;
} HrrRenderDesc;

// What there is to know about a render. Set struct_size before the call.
typedef struct HrrRenderInfo {
  // sizeof(HrrRenderInfo).
  uint32_t struct_size;
  // Pixels across.
  uint32_t width;
  // Pixels down.
  uint32_t height;
  // 1: progress ended it.
  uint32_t interrupted;
  // Iterations that are in the image; with none it is black.
  uint64_t iterations;
  // Eye subpaths of each pixel.
  uint64_t samples;
  // Time that it took, in seconds, without loading.
  double seconds;
} HrrRenderInfo;

// The call did what it says.
#define HRR_OK 0

// An argument is NULL, out of its range or contradicts another.
#define HRR_ERROR_INVALID_ARGUMENT 1

// The call does not fit what was called before: an end without a beginning, two beginnings.
#define HRR_ERROR_INVALID_STATE 2

// An input is NaN, infinite, or too large for single precision; the message names it.
#define HRR_ERROR_NON_FINITE 3

// The memory is not there, or max_bytes does not allow it.
#define HRR_ERROR_OUT_OF_MEMORY 4

// The host's progress function ended the call.
#define HRR_ERROR_CANCELLED 5

// The results do not fit; the number that would is written. The same call again gives the same results.
#define HRR_ERROR_BUFFER_TOO_SMALL 6

// Header and library do not belong together, or a struct_size is none.
#define HRR_ERROR_ABI 7

// A file cannot be read or written, or is not what it should be; the message names it, with the line where it has any.
#define HRR_ERROR_IO 8

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

// The library's version as text, and the libraries it was built with. Static: never freed. Any thread.
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

// Gives up a reference; the last one ends the context's threads and waits for that. NULL is allowed. Caches live on
// without their context. Any thread, but not within a callback.
HRR_API
void hrr_context_release(struct HrrContext *context);

// Describes a context. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI.
HRR_API HrrStatus hrr_context_info(const struct HrrContext *context, struct HrrContextInfo *info);

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
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE, HRR_ERROR_OUT_OF_MEMORY, HRR_ERROR_ABI,
// HRR_ERROR_CANCELLED; *out_cache is then as it was.
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

// Checks a cache: every vertex once, every box around what is below it, every mask the union of those below. For memory
// that something else has written to. Reads the whole cache, in some 20 ns for each vertex. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_INTERNAL (the message says what is wrong).
HRR_API
HrrStatus hrr_cache_validate(const struct HrrCache *cache);

// Writes a cache's light vertices to a file (path in UTF-8), whole or not at all; what was there is replaced. About 20
// bytes for each vertex, the same on every machine. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_IO.
HRR_API
HrrStatus hrr_cache_save(const struct HrrCache *cache,
                         const char *path);

// Makes the cache that hrr_cache_save wrote: the same hits for the same queries. The file is not trusted: one that is
// damaged is refused. The tree is built anew. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_IO, HRR_ERROR_OUT_OF_MEMORY.
HRR_API
HrrStatus hrr_cache_load(const struct HrrContext *context,
                         const char *path,
                         struct HrrCache **out_cache);

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
// and allocates nothing unless it fails (or is captured: hrr_capture_begin).
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

// Makes a capture's caches and queries again, on one of the context's threads, and compares the hits. path: in UTF-8.
// The file is not trusted. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI, HRR_ERROR_IO, HRR_ERROR_OUT_OF_MEMORY. That hits differ is none:
// see `differences`.
HRR_API
HrrStatus hrr_capture_replay(const struct HrrContext *context,
                             const char *path,
                             struct HrrCapture *capture);

// Begins to write the context's caches and queries to a file (path in UTF-8): each cache once, when it is queried
// first, and each query with a fingerprint of its hits. For reports of errors and for measuring: hrr_capture_replay
// makes them again. max_bytes: queries that would make the file larger are left out; 0 = no limit. Queries take a lock
// meanwhile. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_INVALID_STATE (one goes on already), HRR_ERROR_IO.
HRR_API
HrrStatus hrr_capture_begin(const struct HrrContext *context,
                            const char *path,
                            uint64_t max_bytes);

// Ends a capture. capture: what is in the file, NULL if not wanted; set its struct_size before. Queries that go on at
// the same time are in the file or not. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI, HRR_ERROR_INVALID_STATE (none goes on), HRR_ERROR_IO (the file is
// not complete; the capture has ended).
HRR_API
HrrStatus hrr_capture_end(const struct HrrContext *context,
                          struct HrrCapture *capture);

// Builds geometry with one reference, which hrr_geometry_release gives up. Blocks until the tree is built. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT (also for a backend that the library was built without), HRR_ERROR_NON_FINITE,
// HRR_ERROR_OUT_OF_MEMORY, HRR_ERROR_ABI, HRR_ERROR_INTERNAL (Embree failed).
HRR_API
HrrStatus hrr_geometry_build(const struct HrrContext *context,
                             const struct HrrGeometryDesc *desc,
                             struct HrrGeometry **out_geometry);

// Adds a reference; NULL is allowed. Any thread.
HRR_API void hrr_geometry_retain(struct HrrGeometry *geometry);

// Gives up a reference; the last one frees the geometry. NULL is allowed. Any thread.
HRR_API void hrr_geometry_release(struct HrrGeometry *geometry);

// Finds what rays hit first. rays: ray_count of them, ray_stride bytes apart (0 = packed). hits: room for ray_count.
// Any thread, this one only; takes no lock.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE; hits before the ray that is named are written.
HRR_API
HrrStatus hrr_intersect(const struct HrrGeometry *geometry,
                        const struct HrrRay *rays,
                        size_t ray_stride,
                        uint64_t ray_count,
                        struct HrrRayHit *hits);

// Finds which rays hit anything: 1, or 0 where the way is free. As hrr_intersect, and out_occluded: room for ray_count.
// Any thread, this one only; takes no lock.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE; what is before the ray that is named is written.
HRR_API
HrrStatus hrr_occluded(const struct HrrGeometry *geometry,
                       const struct HrrRay *rays,
                       size_t ray_stride,
                       uint64_t ray_count,
                       uint8_t *out_occluded);

// The ray that leaves a surface in a direction, to infinity: it starts off the surface by what single precision needs,
// so that it does not hit the surface again. position, normal (geometric, of any length, either side), direction: 3
// numbers each. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE.
HRR_API
HrrStatus hrr_ray_leave(const struct HrrGeometry *geometry,
                        const double *position,
                        const double *normal,
                        const double *direction,
                        struct HrrRay *out_ray);

// Finds which of a query's hits are not seen from its eye vertex: 1, or 0 where the way is free. eye: position; 3
// numbers. eye_normal: the geometric normal there, NULL when it is on no surface. Rays start and end off the surfaces by
// what single precision needs. out_occluded: room for hit_count. Any thread, this one only; takes no lock.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT (also an id that `lights` does not have), HRR_ERROR_NON_FINITE, HRR_ERROR_ABI.
HRR_API
HrrStatus hrr_occluded_hits(const struct HrrGeometry *geometry,
                            const double *eye,
                            const double *eye_normal,
                            const struct HrrLights *lights,
                            const struct HrrHit *hits,
                            uint64_t hit_count,
                            uint8_t *out_occluded);

// hrr_query and hrr_occluded_hits in one: writes those accepted light vertices that the eye vertex sees, in the order of
// hrr_query. eye_normal: the geometric normal at the eye vertex, NULL when it is on no surface. All else as hrr_query;
// counters count hits that are seen or not. Any thread; takes no lock, and allocates nothing unless it fails.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_NON_FINITE, HRR_ERROR_ABI, HRR_ERROR_BUFFER_TOO_SMALL.
HRR_API
HrrStatus hrr_query_visible(const struct HrrCache *cache,
                            const struct HrrGeometry *geometry,
                            const struct HrrQuery *query,
                            const struct HrrQueryOptions *options,
                            const double *eye_normal,
                            const struct HrrLights *lights,
                            struct HrrHit *hits,
                            uint64_t capacity,
                            uint64_t *out_count,
                            struct HrrCounters *counters);

// Loads a scene, a .toml or .obj file with what it names, with one reference, which hrr_scene_release gives up. path: in
// UTF-8. settings: setting_count of them that take the place of the file's; NULL when there are none. Remarks are logged
// and kept. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT (a setting; also an effect that the library does not have), HRR_ERROR_IO (with file
// and line).
HRR_API
HrrStatus hrr_scene_load(const struct HrrContext *context,
                         const char *path,
                         const struct HrrSetting *settings,
                         uint32_t setting_count,
                         struct HrrScene **out_scene);

// Adds a reference; NULL is allowed. Any thread.
HRR_API void hrr_scene_retain(struct HrrScene *scene);

// Gives up a reference; the last one frees the scene. NULL is allowed. Any thread.
HRR_API void hrr_scene_release(struct HrrScene *scene);

// Describes a scene. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI.
HRR_API HrrStatus hrr_scene_info(const struct HrrScene *scene, struct HrrSceneInfo *info);

// One of the loader's remarks, index below warning_count, in English. The scene's: valid as long as it is; never freed
// by the host. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT.
HRR_API
HrrStatus hrr_scene_warning(const struct HrrScene *scene,
                            uint32_t index,
                            const char **out_text);

// Renders a scene and blocks until that is done; makes a render with one reference, which hrr_render_release gives up.
// desc: NULL for the scene's own settings. The image is the one that the program `hrr render` makes, to the last bit.
// Uses threads of its own, not the pool. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT (a setting, or what the scene asks for), HRR_ERROR_ABI, HRR_ERROR_OUT_OF_MEMORY,
// HRR_ERROR_INTERNAL.
HRR_API
HrrStatus hrr_render(const struct HrrContext *context,
                     const struct HrrScene *scene,
                     const struct HrrRenderDesc *desc,
                     struct HrrRender **out_render);

// Adds a reference; NULL is allowed. Any thread.
HRR_API void hrr_render_retain(struct HrrRender *render);

// Gives up a reference; the last one frees the render. NULL is allowed. Any thread.
HRR_API void hrr_render_release(struct HrrRender *render);

// Describes a render. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_ABI.
HRR_API HrrStatus hrr_render_info(const struct HrrRender *render, struct HrrRenderInfo *info);

// Writes the image to rgb: linear red, green, blue, row by row, the top row first. capacity: floats that there is room
// for, at least 3 width height. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_BUFFER_TOO_SMALL (nothing is written).
HRR_API
HrrStatus hrr_render_pixels(const struct HrrRender *render,
                            float *rgb,
                            uint64_t capacity);

// Writes the image to a file, .exr or .png by the path (in UTF-8), whole or not at all. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT, HRR_ERROR_IO.
HRR_API HrrStatus hrr_render_write(const struct HrrRender *render, const char *path);

// What the render did and what it cost, as JSON, as `hrr render --stats` has it. The render's: valid as long as it is;
// never freed by the host. Any thread.
//
// Errors: HRR_ERROR_INVALID_ARGUMENT.
HRR_API
HrrStatus hrr_render_stats(const struct HrrRender *render,
                           const char **out_json);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* HRR_H */
