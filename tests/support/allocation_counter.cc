#include "tests/support/allocation_counter.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <numeric>
#include <vector>

namespace {

std::atomic<std::size_t> allocations{0};

}  // namespace

#ifdef __SANITIZE_ADDRESS__
// The sanitizer's own allocator stays in place and reports what it gives out (GCC 12 lacks the
// header that declares this function of it).
extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*on_malloc)(const volatile void*,
                                                                           std::size_t),
                                                         void (*on_free)(const volatile void*));
[[maybe_unused]] const int kHooks = __sanitizer_install_malloc_and_free_hooks(
    [](const volatile void*, std::size_t) { ++allocations; }, [](const volatile void*) {});
#else
// glibc's allocator under its other names. operator new ends here, and so do Eigen's matrices.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) noexcept {
  ++allocations;
  return __libc_malloc(size);
}
void* realloc(void* memory, std::size_t size) noexcept {
  ++allocations;
  return __libc_realloc(memory, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  ++allocations;
  return __libc_memalign(alignment, size);
}
}
#endif

namespace mbv {

std::size_t AllocationCount() { return allocations; }

TEST(AllocationCounter, SeesAnAllocation) {
  const std::size_t before = AllocationCount();
  std::vector<double> values(100, 1.0);
  EXPECT_GT(AllocationCount(), before) << values.front();
}

TEST(AllocationCounter, SeesMatricesOfDynamicSize) {
  const std::size_t before = AllocationCount();
  Eigen::MatrixXd values = Eigen::MatrixXd::Ones(10, 10);
  EXPECT_GT(AllocationCount(), before) << values(0, 0);
  const std::size_t after = AllocationCount();
  values.resize(20, 10);
  EXPECT_GT(AllocationCount(), after);
}

TEST(AllocationCounter, SeesTheBufferOfAStableSort) {
  std::vector<int> values(100);
  std::iota(values.rbegin(), values.rend(), 0);
  const std::size_t before = AllocationCount();
  std::stable_sort(values.begin(), values.end());
  EXPECT_GT(AllocationCount(), before);
  EXPECT_EQ(values.front(), 0);
}

}  // namespace mbv
