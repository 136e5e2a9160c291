// minimal.c with hrr.hpp: a batch on the host's own threads, and an exception through a callback.
#include "hrr.hpp"

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <thread>

namespace {

/// As TBB or OpenMP would do it.
void on_three_threads(uint32_t count, const hrr::Task &task) {
  std::atomic<uint32_t> next(0);
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; i++) {
    threads.emplace_back([&next, &task, count] {
      for (uint32_t k = next++; k < count; k = next++) {
        task(k);
      }
    });
  }
  for (std::thread &thread : threads) {
    thread.join();
  }
}

void require(bool holds, const char *what) {
  if (!holds) {
    std::fprintf(stderr, "does not hold: %s\n", what);
    std::exit(1);
  }
}

} // namespace

int main() {
  // Two threads' light vertices, in doubles, far from the origin.
  std::vector<double> first, second;
  uint64_t state = 1;
  for (int i = 0; i < 30000; i++) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    (i % 3 == 0 ? first : second).push_back(1e6 + static_cast<double>(state >> 40) / 16777216.0);
  }
  HrrSegment segments[2] = {};
  segments[0].position = first.data();
  segments[0].count = first.size() / 3;
  segments[1].position = second.data();
  segments[1].count = second.size() / 3;
  segments[1].first_id = 1u << 20;

  hrr::Context context(on_three_threads);
  hrr::Cache cache(context, std::vector<HrrSegment>(segments, segments + 2), HRR_DOUBLE3);
  require(cache.info().vertex_count == first.size() / 3 + second.size() / 3, "all vertices are in the cache");

  const HrrLobe lobe = hrr::lobe_sphere(1.0);
  std::vector<HrrQuery> queries(3000);
  for (size_t i = 0; i < queries.size(); i++) {
    queries[i] = HrrQuery();
    queries[i].position[0] = queries[i].position[1] = queries[i].position[2] = 1e6 + 0.5;
    queries[i].lobes = &lobe;
    queries[i].lobe_count = 1;
    queries[i].mask = ~0u;
    queries[i].constant = 1e-4;
    queries[i].key = hrr_key(1, 2, i, 3);
  }
  HrrCounters counters = HrrCounters();
  hrr::Batch batch = cache.query_batch(context, queries.data(), queries.size(), sizeof(HrrQuery), nullptr, &counters);
  require(counters.queries == queries.size(), "every query was made once");

  std::vector<HrrHit> hits;
  size_t k = 0;
  for (const HrrQuery &query : queries) {
    cache.query(query, hits);
    for (const HrrHit &hit : hits) {
      require(hit.id == batch.hits[k].id && hit.probability == batch.hits[k].probability, "a batch is its queries");
      k++;
    }
  }
  require(k > 100 && k == batch.hits.size(), "there are hits, and no more in the batch");

  bool thrown = false;
  try {
    for (const HrrQuery &query : queries) {
      cache.visit(query, [](const HrrHit &) { throw std::out_of_range("from the callback"); });
    }
  } catch (const std::out_of_range &) {
    thrown = true;
  }
  require(thrown, "exceptions cross callbacks");

  hrr::Context failing([](uint32_t, const hrr::Task &) { throw std::bad_alloc(); });
  thrown = false;
  try {
    cache.query_batch(failing, queries.data(), queries.size());
  } catch (const std::bad_alloc &) {
    thrown = true;
  }
  require(thrown, "exceptions cross parallel_for");

  try {
    queries[0].constant = -1;
    cache.query(queries[0], hits);
    require(false, "a negative constant is refused");
  } catch (const hrr::Error &error) {
    require(error.status() == HRR_ERROR_INVALID_ARGUMENT, "the status is told");
    std::printf("refused as it should be: %s\n", error.what());
  }
  hrr::Cache copy = cache, moved = std::move(cache);
  require(copy.get() == moved.get() && copy.hash() == moved.hash(), "copies share the cache");
  std::printf("%zu hits; all is well\n", k);
  return 0;
}
