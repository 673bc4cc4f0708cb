// CUDA on the processor: the blocks of a kernel run one after the other, with their threads at the same time.

#include <cmath>
#include <pthread.h>
#include <thread>
#include <vector>
#define __global__
#define __device__
#define __shared__ static
struct Place { int x; };
static thread_local Place threadIdx;
static Place blockIdx, blockDim, gridDim;
static pthread_barrier_t barrier;
static void __syncthreads() { pthread_barrier_wait(&barrier); }
static void __threadfence() {}
static unsigned atomicInc(unsigned* place, unsigned last) {
    const unsigned before = *place;
    *place = before >= last ? 0 : before + 1;
    return before;
}
template <class Kernel> static void run(int blocks, int threads, Kernel kernel) {
    gridDim.x = blocks, blockDim.x = threads;
    pthread_barrier_init(&barrier, nullptr, threads);
    for (blockIdx.x = 0; blockIdx.x < blocks; ++blockIdx.x) {
        std::vector<std::thread> running;
        for (int k = 0; k < threads; ++k) running.emplace_back([=] { threadIdx.x = k; kernel(); });
        for (auto& one : running) one.join();
    }
    pthread_barrier_destroy(&barrier);
}
