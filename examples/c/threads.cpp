// A host with a thread pool of its own, which answers libhrr's batches; eight threads that query one cache while the next
// ones are built; saving, loading, capturing and replaying; ending a build.
#include "hrr.hpp"

#include <atomic>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <thread>

namespace {

const unsigned THREADS = 8;

void require(bool holds, const char *what) {
  if (!holds) {
    std::fprintf(stderr, "does not hold: %s\n", what);
    std::exit(1);
  }
}

// Threads that sleep until there is a loop to run; one loop at a time.
class Pool {
public:
  Pool() {
    for (unsigned i = 0; i < THREADS; i++) {
      threads_.emplace_back([this] { work(); });
    }
  }

  ~Pool() {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      ending_ = true;
    }
    wake_.notify_all();
    for (std::thread &thread : threads_) {
      thread.join();
    }
  }

  // What libhrr asks of a host: run task(0) to task(count - 1), and return when all have ended.
  void parallel_for(uint32_t count, const hrr::Task &task) {
    std::lock_guard<std::mutex> one_loop(loops_);
    std::unique_lock<std::mutex> lock(mutex_);
    task_ = &task;
    next_ = 0;
    count_ = left_ = count;
    wake_.notify_all();
    done_.wait(lock, [this] { return left_ == 0; });
    task_ = nullptr;
    total_ += count;
  }

  uint64_t total() {
    std::lock_guard<std::mutex> lock(mutex_);
    return total_;
  }

private:
  void work() {
    std::unique_lock<std::mutex> lock(mutex_);
    for (;;) {
      wake_.wait(lock, [this] { return ending_ || (task_ != nullptr && next_ < count_); });
      if (ending_) {
        return;
      }
      const hrr::Task &task = *task_;
      const uint32_t index = next_++;
      lock.unlock();
      task(index);
      lock.lock();
      if (--left_ == 0) {
        done_.notify_all();
      }
    }
  }

  std::mutex loops_, mutex_;
  std::condition_variable wake_, done_;
  std::vector<std::thread> threads_;
  const hrr::Task *task_ = nullptr;
  uint32_t next_ = 0, count_ = 0, left_ = 0;
  uint64_t total_ = 0;
  bool ending_ = false;
};

// Light vertices on a wavy sheet, the same for the same number.
std::vector<float> vertices(uint64_t count) {
  std::vector<float> positions;
  uint64_t state = 7;
  for (uint64_t i = 0; i < 3 * count; i++) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    float u = static_cast<float>(state >> 40) / 16777216.0f;
    positions.push_back(i % 3 == 2 ? 0.05f * u : u);
  }
  return positions;
}

HrrSegment segment(const std::vector<float> &positions) {
  HrrSegment segment = HrrSegment();
  segment.position = positions.data();
  segment.count = positions.size() / 3;
  return segment;
}

bool same(const std::vector<HrrHit> &a, const HrrHit *b) {
  for (const HrrHit &hit : a) {
    if (hit.id != b->id || !(hit.probability == b->probability)) {
      return false;
    }
    b++;
  }
  return true;
}

} // namespace

int main(int argc, char **argv) {
  const std::string directory = argc > 1 ? argv[1] : ".";
  Pool pool;
  std::atomic<int64_t> memory(0);
  std::atomic<int> messages(0);
  {
    hrr::ContextOptions options;
    options.threads = 2;
    options.parallel_for = [&pool](uint32_t count, const hrr::Task &task) { pool.parallel_for(count, task); };
    options.log = [&messages](uint32_t level, const char *text) { messages += level > 0 && text[0] != '\0'; };
    options.memory = [&memory](int64_t bytes) { return memory += bytes, true; };
    const hrr::Context context(options);

    const std::vector<float> positions = vertices(20000);
    const hrr::Cache cache(context, {segment(positions)});
    require(memory > 20000 * 20, "the host is told of memory");
    std::vector<HrrLobe> lobes;
    std::vector<HrrQuery> queries(3000);
    for (size_t i = 0; i < queries.size(); i++) {
      const double normal[3] = {0, 0, 1}, wo[3] = {0.6, 0, 0.8};
      lobes.push_back(hrr::lobe_reflection(normal, nullptr, wo, 0.3, 0.1 + 0.0001 * static_cast<double>(i)));
    }
    for (size_t i = 0; i < queries.size(); i++) {
      queries[i] = HrrQuery();
      queries[i].position[0] = static_cast<double>(i) / 6000;
      queries[i].position[1] = 0.5;
      queries[i].position[2] = -0.2;
      queries[i].lobes = &lobes[i];
      queries[i].lobe_count = 1;
      queries[i].mask = ~0u;
      queries[i].constant = 1e-4;
      queries[i].key = hrr_key(3, 0, i, 0);
    }
    const hrr::Batch batch = cache.query_batch(context, queries.data(), queries.size());
    require(pool.total() > 0, "the batch ran on the host's threads");
    require(batch.hits.size() > 1000, "there are hits");

    // One cache queried by many threads, whole and one by one, while others are built and released.
    std::atomic<bool> wrong(false);
    std::vector<std::thread> threads;
    for (unsigned k = 0; k < THREADS; k++) {
      threads.emplace_back([&, k] {
        std::vector<HrrHit> hits;
        for (int round = 0; round < 3; round++) {
          for (size_t i = k; i < queries.size(); i += 3) {
            cache.query(queries[i], hits);
            if (hits.size() != batch.offsets[i + 1] - batch.offsets[i] ||
                !same(hits, batch.hits.data() + batch.offsets[i])) {
              wrong = true;
            }
          }
        }
      });
    }
    for (uint64_t count : {20000u, 100u, 30000u, 1u, 20000u}) {
      const std::vector<float> others = vertices(count);
      const hrr::Cache other(context, {segment(others)});
      other.validate();
      require((other.hash() == cache.hash()) == (count == 20000), "equal vertices make equal caches");
      const uint64_t found = other.query_batch(context, queries.data(), 500).offsets.back();
      require(found > 0 || count <= 100, "the new cache answers, too");
    }
    for (std::thread &thread : threads) {
      thread.join();
    }
    require(!wrong, "all threads see the same hits");

    // A cache on disk, and queries as they were made.
    const std::string saved = directory + "/threads.cache", captured = directory + "/threads.capture";
    cache.save(saved);
    context.capture_begin(captured);
    const hrr::Cache loaded = hrr::Cache::load(context, saved);
    require(loaded.hash() == cache.hash(), "a loaded cache is the one that was saved");
    loaded.query_batch(context, queries.data(), 400);
    std::vector<HrrHit> hits;
    cache.query(queries[0], hits);
    const HrrCapture written = context.capture_end();
    require(written.caches == 2 && written.queries >= 401 && written.left_out == 0, "all was captured");
    const HrrCapture replayed = context.capture_replay(captured);
    require(replayed.queries == written.queries && replayed.differences == 0, "a replay has the same hits");
    std::remove(saved.c_str());
    std::remove(captured.c_str());

#ifndef __SANITIZE_THREAD__ // which does not see that the library's threads, who call progress, wait for this one
    // A build that is ended, and one whose progress throws.
    HrrBuildDesc desc = hrr::make<HrrBuildDesc>();
    const HrrSegment one = segment(positions);
    desc.segments = &one;
    desc.segment_count = 1;
    HrrStatus status = HRR_OK;
    try {
      hrr::Cache(context, desc, [](double) { return false; });
    } catch (const hrr::Error &error) {
      status = error.status();
    }
    require(status == HRR_ERROR_CANCELLED, "progress ends a build");
    bool thrown = false;
    try {
      hrr::Cache(context, desc, [](double done) -> bool {
        if (done > 0.9) {
          throw std::out_of_range("from progress");
        }
        return true;
      });
    } catch (const std::out_of_range &) {
      thrown = true;
    }
    require(thrown, "exceptions cross progress");
#endif
    std::printf("%zu hits, %d messages, %.1f MB held\n", batch.hits.size(), messages.load(),
                static_cast<double>(memory) * 1e-6);
  }
  require(memory == 0, "all memory is given back");
  std::puts("all is well");
  return 0;
}
