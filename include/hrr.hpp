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

template <class T, void (*Retain)(T *), void (*Release)(T *)> class Handle {
public:
  Handle() noexcept : object_(nullptr) {}
  Handle(const Handle &other) noexcept : object_(other.object_) { Retain(object_); }
  Handle(Handle &&other) noexcept : object_(other.object_) { other.object_ = nullptr; }
  Handle &operator=(Handle other) noexcept {
    std::swap(object_, other.object_);
    return *this;
  }
  ~Handle() { Release(object_); }

  /// The C handle; still owned here.
  T *get() const noexcept { return object_; }
  explicit operator bool() const noexcept { return object_ != nullptr; }

protected:
  explicit Handle(T *object) noexcept : object_(object) {}
  T *object_;
};

} // namespace detail

/// A task of parallel_for.
using Task = std::function<void(uint32_t index)>;
/// Calls task(i) once for each i in [0, count) and returns when all have ended.
using ParallelFor = std::function<void(uint32_t count, const Task &task)>;

/// Threads and spare memory; copies share them.
class Context : public detail::Handle<HrrContext, hrr_context_retain, hrr_context_release> {
public:
  /// With a pool of its own: 0 = one thread for each processor.
  explicit Context(uint32_t threads = 0) {
    check_abi();
    HrrContextDesc desc = make<HrrContextDesc>();
    desc.threads = threads;
    check(hrr_context_new(&desc, &object_));
  }

  /// With the host's threads for batches. What parallel_for throws is thrown by query_batch.
  explicit Context(ParallelFor parallel_for, uint32_t threads = 1)
      : host_(std::make_shared<Host>(std::move(parallel_for))) {
    check_abi();
    HrrContextDesc desc = make<HrrContextDesc>();
    desc.threads = threads;
    desc.parallel_for = &Host::run;
    desc.parallel_user = host_.get();
    check(hrr_context_new(&desc, &object_));
  }

  /// Frees the memory kept for the next build.
  void trim() const { check(hrr_context_trim(object_)); }

  /// Throws when the library does not do here what it should.
  void self_test(uint64_t seed = 0) const { check(hrr_self_test(object_, seed)); }

private:
  friend class Cache;

  struct Host {
    explicit Host(ParallelFor f) : parallel_for(std::move(f)) {}

    static void run(void *user, uint32_t count, HrrTaskFn task, void *data) {
      Host *host = static_cast<Host *>(user);
      try {
        host->parallel_for(count, [task, data](uint32_t index) { task(data, index); });
      } catch (...) {
        host->caught.keep();
      }
    }

    ParallelFor parallel_for;
    detail::Caught caught;
  };

  /// As check, for calls that may have run the host's parallel_for.
  void check_tasks(HrrStatus status) const {
    if (host_ && status == HRR_ERROR_CALLBACK) {
      host_->caught.check(status);
    }
    check(status);
  }

  std::shared_ptr<Host> host_;
};

/// The hits of many queries: those of query i are hits[offsets[i]] up to hits[offsets[i + 1]].
struct Batch {
  std::vector<HrrHit> hits;
  std::vector<uint64_t> offsets;
};

/// Light vertices in a tree, immutable; copies share it. Empty handles may be assigned to only.
class Cache : public detail::Handle<HrrCache, hrr_cache_retain, hrr_cache_release> {
public:
  Cache() noexcept {}

  /// As described; struct_size must be set (make<HrrBuildDesc>()).
  Cache(const Context &context, const HrrBuildDesc &desc) {
    check(hrr_cache_build(context.get(), &desc, &object_));
  }

  /// Of segments, with the defaults for all else.
  Cache(const Context &context, const std::vector<HrrSegment> &segments, uint32_t position_format = HRR_FLOAT3) {
    HrrBuildDesc desc = make<HrrBuildDesc>();
    desc.position_format = position_format;
    desc.segments = segments.data();
    desc.segment_count = static_cast<uint32_t>(segments.size());
    check(hrr_cache_build(context.get(), &desc, &object_));
  }

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
    hits.resize(hits.capacity() > 0 ? hits.capacity() : 64);
    for (;;) {
      uint64_t count = 0;
      HrrCounters did = HrrCounters();
      HrrStatus status = hrr_query(object_, &query, options, hits.data(), hits.size(), &count, &did);
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
  static void add(HrrCounters &sum, const HrrCounters &did) {
    sum.queries += did.queries;
    sum.nodes += did.nodes;
    sum.tests += did.tests;
    sum.leaves += did.leaves;
    sum.accepted += did.accepted;
    sum.expected += did.expected;
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
