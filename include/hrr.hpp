// hrr.hpp - libhrr for C++11: handles that release themselves, statuses as exceptions, callables as callbacks.
//
// Header only, on top of hrr.h, whose plain structs (HrrLobe, HrrQuery, HrrHit, ...) it uses as they are. What a
// callable throws in a callback is carried across the library and thrown again to the caller.
#ifndef HRR_HPP
#define HRR_HPP

#include "hrr.h"

#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace hrr {

/// A call that failed: its status, and the library's message.
class Error : public std::runtime_error {
public:
  Error(HrrStatus status, const char *message) : std::runtime_error(message), status_(status) {}

  /// One of HRR_ERROR_*.
  HrrStatus status() const noexcept { return status_; }

private:
  HrrStatus status_;
};

/// Throws unless a status is HRR_OK.
inline void check(HrrStatus status) {
  if (status != HRR_OK) {
    throw Error(status, hrr_last_error());
  }
}

/// Throws unless header and library belong together. Context's constructors call it.
inline void check_abi() { check(hrr_check_abi(HRR_ABI)); }

/// A zeroed struct that begins with its size.
template <class T> T make() {
  T t = T();
  t.struct_size = static_cast<uint32_t>(sizeof(T));
  return t;
}

namespace detail {

/// The exception of a callback: the first of any thread's.
class Caught {
public:
  void keep() noexcept {
    std::lock_guard<std::mutex> lock(mutex_);
    if (!exception_) {
      exception_ = std::current_exception();
    }
  }

  /// Throws it, or an Error when there is none and the status says so.
  void check(HrrStatus status) {
    std::exception_ptr exception;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      std::swap(exception, exception_);
    }
    if (exception) {
      std::rethrow_exception(exception);
    }
    hrr::check(status);
  }

private:
  std::mutex mutex_;
  std::exception_ptr exception_;
};

/// The functions of a context, kept as long as anything of the library may call them.
struct Host;

template <class T, void (*Retain)(T *), void (*Release)(T *)> class Handle {
public:
  Handle() noexcept : object_(nullptr) {}
  Handle(const Handle &other) noexcept : object_(other.object_), host_(other.host_) { Retain(object_); }
  Handle(Handle &&other) noexcept : object_(other.object_), host_(std::move(other.host_)) {
    other.object_ = nullptr;
  }
  Handle &operator=(Handle other) noexcept {
    std::swap(object_, other.object_);
    std::swap(host_, other.host_);
    return *this;
  }
  ~Handle() { Release(object_); }

  /// The C handle; still owned here.
  T *get() const noexcept { return object_; }
  explicit operator bool() const noexcept { return object_ != nullptr; }

protected:
  explicit Handle(std::shared_ptr<Host> host) noexcept : object_(nullptr), host_(std::move(host)) {}
  T *object_;
  std::shared_ptr<Host> host_;
};

} // namespace detail

/// A task of parallel_for.
using Task = std::function<void(uint32_t index)>;
/// Calls task(i) once for each i in [0, count) and returns when all have ended.
using ParallelFor = std::function<void(uint32_t count, const Task &task)>;
/// Takes a message of a level, HRR_LOG_*. What it throws is lost.
using Log = std::function<void(uint32_t level, const char *message)>;
/// Told of bytes taken (above 0; false refuses) and given back (below 0). What it throws counts as false.
using Memory = std::function<bool(int64_t bytes)>;
/// Told how much is done, 0 to 1; false ends the call. What it throws ends the call and is thrown again.
using Progress = std::function<bool(double done)>;

/// How to make a context.
struct ContextOptions {
  uint32_t threads = 0;
  ParallelFor parallel_for;
  Log log;
  uint32_t log_level = HRR_LOG_INFO;
  Memory memory;
};

namespace detail {

struct Host {
  explicit Host(ContextOptions o) : options(std::move(o)) {}

  static void run(void *user, uint32_t count, HrrTaskFn task, void *data) {
    Host *host = static_cast<Host *>(user);
    try {
      host->options.parallel_for(count, [task, data](uint32_t index) { task(data, index); });
    } catch (...) {
      host->caught.keep();
    }
  }

  static void say(void *user, uint32_t level, const char *message) {
    try {
      static_cast<Host *>(user)->options.log(level, message);
    } catch (...) {
    }
  }

  static int32_t ask(void *user, int64_t bytes) {
    try {
      return static_cast<Host *>(user)->options.memory(bytes) ? 0 : 1;
    } catch (...) {
      return 1;
    }
  }

  ContextOptions options;
  Caught caught;
};

/// A progress function for the time of one call.
class Watch {
public:
  explicit Watch(const Progress &progress) : progress_(&progress) {}

  HrrProgressFn function() const { return *progress_ ? &Watch::run : nullptr; }

  /// Throws what the function has thrown, or an Error when the status says so.
  void check(HrrStatus status) { caught_.check(status); }

private:
  static int32_t run(void *user, double done) {
    Watch *watch = static_cast<Watch *>(user);
    try {
      return (*watch->progress_)(done) ? 0 : 1;
    } catch (...) {
      watch->caught_.keep();
      return 1;
    }
  }

  const Progress *progress_;
  Caught caught_;
};

} // namespace detail

/// Threads and spare memory; copies share them.
class Context : public detail::Handle<HrrContext, hrr_context_retain, hrr_context_release> {
public:
  /// With a pool of its own: 0 = one thread for each processor.
  explicit Context(uint32_t threads = 0) {
    ContextOptions options;
    options.threads = threads;
    open(std::move(options));
  }

  /// With the host's threads for batches. What parallel_for throws is thrown by query_batch.
  explicit Context(ParallelFor parallel_for, uint32_t threads = 1) {
    ContextOptions options;
    options.parallel_for = std::move(parallel_for);
    options.threads = threads;
    open(std::move(options));
  }

  /// With the host's functions. The library may call them as long as there is anything made with the context.
  explicit Context(ContextOptions options) { open(std::move(options)); }

  HrrContextInfo info() const {
    HrrContextInfo info = make<HrrContextInfo>();
    check(hrr_context_info(object_, &info));
    return info;
  }

  /// Frees the memory kept for the next build.
  void trim() const { check(hrr_context_trim(object_)); }

  /// Throws when the library does not do here what it should.
  void self_test(uint64_t seed = 0) const { check(hrr_self_test(object_, seed)); }

  /// Writes caches and queries to a file from now on.
  void capture_begin(const std::string &path, uint64_t max_bytes = 0) const {
    check(hrr_capture_begin(object_, path.c_str(), max_bytes));
  }

  HrrCapture capture_end() const {
    HrrCapture capture = make<HrrCapture>();
    check(hrr_capture_end(object_, &capture));
    return capture;
  }

  /// Makes a capture's queries again; see HrrCapture::differences.
  HrrCapture capture_replay(const std::string &path) const {
    HrrCapture capture = make<HrrCapture>();
    check(hrr_capture_replay(object_, path.c_str(), &capture));
    return capture;
  }

private:
  friend class Cache;

  void open(ContextOptions options) {
    check_abi();
    host_ = std::make_shared<detail::Host>(std::move(options));
    const ContextOptions &own = host_->options;
    HrrContextDesc desc = make<HrrContextDesc>();
    desc.threads = own.threads;
    desc.parallel_for = own.parallel_for ? &detail::Host::run : nullptr;
    desc.log = own.log ? &detail::Host::say : nullptr;
    desc.memory = own.memory ? &detail::Host::ask : nullptr;
    desc.parallel_user = desc.log_user = desc.memory_user = host_.get();
    desc.log_level = own.log_level;
    check(hrr_context_new(&desc, &object_));
  }

  /// As check, for calls that may have run the host's parallel_for.
  void check_tasks(HrrStatus status) const {
    if (status == HRR_ERROR_CALLBACK) {
      host_->caught.check(status);
    }
    check(status);
  }

  const std::shared_ptr<detail::Host> &host() const { return host_; }
};

/// The hits of many queries: those of query i are hits[offsets[i]] up to hits[offsets[i + 1]].
struct Batch {
  std::vector<HrrHit> hits;
  std::vector<uint64_t> offsets;
};

class Geometry;

/// Light vertices in a tree, immutable; copies share it. Empty handles may be assigned to only.
class Cache : public detail::Handle<HrrCache, hrr_cache_retain, hrr_cache_release> {
public:
  Cache() noexcept {}

  /// As described; struct_size must be set (make<HrrBuildDesc>()). The description's own progress is not used.
  Cache(const Context &context, HrrBuildDesc desc, const Progress &progress = Progress()) : Handle(context.host()) {
    detail::Watch watch(progress);
    desc.progress = watch.function();
    desc.progress_user = &watch;
    watch.check(hrr_cache_build(context.get(), &desc, &object_));
  }

  /// Of segments, with the defaults for all else.
  Cache(const Context &context, const std::vector<HrrSegment> &segments, uint32_t position_format = HRR_FLOAT3)
      : Handle(context.host()) {
    HrrBuildDesc desc = make<HrrBuildDesc>();
    desc.position_format = position_format;
    desc.segments = segments.data();
    desc.segment_count = static_cast<uint32_t>(segments.size());
    check(hrr_cache_build(context.get(), &desc, &object_));
  }

  /// The one that save wrote.
  static Cache load(const Context &context, const std::string &path) {
    Cache cache;
    cache.host_ = context.host();
    check(hrr_cache_load(context.get(), path.c_str(), &cache.object_));
    return cache;
  }

  void save(const std::string &path) const { check(hrr_cache_save(object_, path.c_str())); }

  /// Throws when the tree is not what it should be.
  void validate() const { check(hrr_cache_validate(object_)); }

  HrrCacheInfo info() const {
    HrrCacheInfo info = make<HrrCacheInfo>();
    check(hrr_cache_info(object_, &info));
    return info;
  }

  uint64_t hash() const {
    uint64_t hash = 0;
    check(hrr_cache_hash(object_, &hash));
    return hash;
  }

  /// P of an edge, to the last bit as a query at `eye` would have it for a vertex at `light`.
  double probability(const HrrLobe *lobes, uint32_t lobe_count, double constant, const double light[3],
                     const double eye[3]) const {
    double offset[3], p = 0.0;
    check(hrr_cache_offset(object_, light, eye, offset));
    check(hrr_probability(lobes, lobe_count, constant, offset, &p));
    return p;
  }

  /// Replaces `hits`, whose memory is used again, by the query's.
  void query(const HrrQuery &query, std::vector<HrrHit> &hits, const HrrQueryOptions *options = nullptr,
             HrrCounters *counters = nullptr) const {
    fill(hits, counters, [&](HrrHit *at, uint64_t room, uint64_t *count, HrrCounters *did) {
      return hrr_query(object_, &query, options, at, room, count, did);
    });
  }

  /// As query, with those hits only that the eye vertex sees. eye_normal: nullptr when it is on no surface.
  void query_visible(const Geometry &geometry, const HrrQuery &query, const double *eye_normal,
                     const HrrLights &lights, std::vector<HrrHit> &hits, const HrrQueryOptions *options = nullptr,
                     HrrCounters *counters = nullptr) const;

  /// Calls visit(hit) for each hit. What it throws ends the query and is thrown again.
  template <class Visit>
  void visit(const HrrQuery &query, Visit &&visit, const HrrQueryOptions *options = nullptr,
             HrrCounters *counters = nullptr) const {
    using Callable = typename std::remove_reference<Visit>::type;
    struct Call {
      Callable *visit;
      std::exception_ptr exception;

      static int32_t run(void *user, const HrrHit *hit) {
        Call *call = static_cast<Call *>(user);
        try {
          (*call->visit)(*hit);
          return 0;
        } catch (...) {
          call->exception = std::current_exception();
          return 1;
        }
      }
    };
    Call call = {&visit, nullptr};
    HrrStatus status = hrr_query_visit(object_, &query, options, &Call::run, &call, counters);
    if (call.exception) {
      std::rethrow_exception(call.exception);
    }
    check(status);
  }

  /// Answers queries, query_stride bytes apart, on the context's threads.
  Batch query_batch(const Context &context, const HrrQuery *queries, uint64_t count,
                    size_t query_stride = sizeof(HrrQuery), const HrrQueryOptions *options = nullptr,
                    HrrCounters *counters = nullptr) const {
    Batch batch;
    batch.offsets.resize(static_cast<size_t>(count) + 1);
    batch.hits.resize(static_cast<size_t>(count) * 4);
    for (;;) {
      HrrCounters did = HrrCounters();
      HrrStatus status = hrr_query_batch(context.get(), object_, queries, query_stride, count, options,
                                         batch.hits.data(), batch.hits.size(), batch.offsets.data(), &did);
      if (status != HRR_ERROR_BUFFER_TOO_SMALL) {
        context.check_tasks(status);
        batch.hits.resize(static_cast<size_t>(batch.offsets.back()));
        if (counters != nullptr) {
          add(*counters, did);
        }
        return batch;
      }
      batch.hits.resize(static_cast<size_t>(batch.offsets.back()));
    }
  }

private:
  template <class Call> static void fill(std::vector<HrrHit> &hits, HrrCounters *counters, Call call) {
    hits.resize(hits.capacity() > 0 ? hits.capacity() : 64);
    for (;;) {
      uint64_t count = 0;
      HrrCounters did = HrrCounters();
      HrrStatus status = call(hits.data(), hits.size(), &count, &did);
      if (status != HRR_ERROR_BUFFER_TOO_SMALL) {
        check(status);
        hits.resize(static_cast<size_t>(count));
        if (counters != nullptr) {
          add(*counters, did);
        }
        return;
      }
      hits.resize(static_cast<size_t>(count));
    }
  }

  static void add(HrrCounters &sum, const HrrCounters &did) {
    sum.queries += did.queries;
    sum.nodes += did.nodes;
    sum.tests += did.tests;
    sum.leaves += did.leaves;
    sum.accepted += did.accepted;
    sum.expected += did.expected;
  }
};

/// Triangles that rays are cast at, immutable; copies share it.
class Geometry : public detail::Handle<HrrGeometry, hrr_geometry_retain, hrr_geometry_release> {
public:
  Geometry() noexcept {}

  Geometry(const Context &context, const std::vector<HrrMesh> &meshes, uint32_t position_format = HRR_FLOAT3,
           uint32_t backend = HRR_BACKEND_DEFAULT) {
    HrrGeometryDesc desc = make<HrrGeometryDesc>();
    desc.position_format = position_format;
    desc.meshes = meshes.data();
    desc.mesh_count = static_cast<uint32_t>(meshes.size());
    desc.backend = backend;
    check(hrr_geometry_build(context.get(), &desc, &object_));
  }

  /// What a ray hits first; mesh is HRR_NO_HIT when it hits nothing.
  HrrRayHit intersect(const HrrRay &ray) const {
    HrrRayHit hit = HrrRayHit();
    check(hrr_intersect(object_, &ray, 0, 1, &hit));
    return hit;
  }

  bool occluded(const HrrRay &ray) const {
    uint8_t occluded = 0;
    check(hrr_occluded(object_, &ray, 0, 1, &occluded));
    return occluded != 0;
  }

  /// Which hits are not seen from an eye vertex: 1, or 0 where the way is free.
  void occluded(const double eye[3], const double *eye_normal, const HrrLights &lights,
                const std::vector<HrrHit> &hits, std::vector<uint8_t> &occluded) const {
    occluded.resize(hits.size());
    check(hrr_occluded_hits(object_, eye, eye_normal, &lights, hits.data(), hits.size(), occluded.data()));
  }

  /// The ray that leaves a surface; see hrr_ray_leave.
  HrrRay leave(const double position[3], const double normal[3], const double direction[3]) const {
    HrrRay ray;
    check(hrr_ray_leave(object_, position, normal, direction, &ray));
    return ray;
  }
};

inline void Cache::query_visible(const Geometry &geometry, const HrrQuery &query, const double *eye_normal,
                                 const HrrLights &lights, std::vector<HrrHit> &hits,
                                 const HrrQueryOptions *options, HrrCounters *counters) const {
  fill(hits, counters, [&](HrrHit *at, uint64_t room, uint64_t *count, HrrCounters *did) {
    return hrr_query_visible(object_, geometry.get(), &query, options, eye_normal, &lights, at, room, count, did);
  });
}

/// Names and values of settings, as in scene files.
using Settings = std::vector<std::pair<std::string, std::string>>;

namespace detail {

/// As the C interface wants them; good as long as the settings are.
inline std::vector<HrrSetting> raw(const Settings &settings) {
  std::vector<HrrSetting> raw;
  for (const std::pair<std::string, std::string> &setting : settings) {
    HrrSetting one = {setting.first.c_str(), setting.second.c_str()};
    raw.push_back(one);
  }
  return raw;
}

} // namespace detail

/// A scene file, loaded; copies share it.
class Scene : public detail::Handle<HrrScene, hrr_scene_retain, hrr_scene_release> {
public:
  Scene(const Context &context, const std::string &path, const Settings &settings = Settings()) {
    std::vector<HrrSetting> raw = detail::raw(settings);
    check(hrr_scene_load(context.get(), path.c_str(), raw.data(), static_cast<uint32_t>(raw.size()), &object_));
  }

  HrrSceneInfo info() const {
    HrrSceneInfo info = make<HrrSceneInfo>();
    check(hrr_scene_info(object_, &info));
    return info;
  }

  /// The loader's remarks.
  std::vector<std::string> warnings() const {
    std::vector<std::string> texts;
    for (uint32_t i = 0; i < info().warning_count; i++) {
      const char *text = nullptr;
      check(hrr_scene_warning(object_, i, &text));
      texts.push_back(text);
    }
    return texts;
  }
};

/// A render that is finished; copies share it.
class Render : public detail::Handle<HrrRender, hrr_render_retain, hrr_render_release> {
public:
  /// Renders. progress: false ends the render after an iteration, with the image so far.
  Render(const Context &context, const Scene &scene, const Settings &settings = Settings(),
         const Progress &progress = Progress()) {
    std::vector<HrrSetting> raw = detail::raw(settings);
    detail::Watch watch(progress);
    HrrRenderDesc desc = make<HrrRenderDesc>();
    desc.setting_count = static_cast<uint32_t>(raw.size());
    desc.settings = raw.data();
    desc.progress = watch.function();
    desc.progress_user = &watch;
    watch.check(hrr_render(context.get(), scene.get(), &desc, &object_));
  }

  HrrRenderInfo info() const {
    HrrRenderInfo info = make<HrrRenderInfo>();
    check(hrr_render_info(object_, &info));
    return info;
  }

  /// Linear red, green, blue, row by row, the top row first.
  std::vector<float> pixels() const {
    HrrRenderInfo own = info();
    std::vector<float> rgb(size_t(3) * own.width * own.height);
    check(hrr_render_pixels(object_, rgb.data(), rgb.size()));
    return rgb;
  }

  /// To an .exr or .png file.
  void write(const std::string &path) const { check(hrr_render_write(object_, path.c_str())); }

  /// What was done and what it cost, as JSON.
  std::string stats() const {
    const char *json = nullptr;
    check(hrr_render_stats(object_, &json));
    return json;
  }
};

/// The lobe of GGX reflection; see hrr_lobe_reflection.
inline HrrLobe lobe_reflection(const double normal[3], const double *tangent, const double wo[3], double alpha_x,
                               double alpha_y, double reflectance = 1.0) {
  HrrLobe lobe;
  check(hrr_lobe_reflection(normal, tangent, wo, alpha_x, alpha_y, reflectance, &lobe));
  return lobe;
}

/// The lobe of GGX transmission; see hrr_lobe_transmission.
inline HrrLobe lobe_transmission(const double normal[3], const double *tangent, const double wo[3],
                                 double alpha_x, double alpha_y, double eta, double transmittance = 1.0) {
  HrrLobe lobe;
  check(hrr_lobe_transmission(normal, tangent, wo, alpha_x, alpha_y, eta, transmittance, &lobe));
  return lobe;
}

/// The lobe that is the same in all directions.
inline HrrLobe lobe_sphere(double weight) {
  HrrLobe lobe;
  check(hrr_lobe_sphere(weight, &lobe));
  return lobe;
}

/// C for about `wanted` accepted vertices; see hrr_constant_for.
inline double constant_for(double wanted, double area, uint64_t vertex_count) {
  double constant = 0.0;
  check(hrr_constant_for(wanted, area, vertex_count, &constant));
  return constant;
}

} // namespace hrr

#endif // HRR_HPP
