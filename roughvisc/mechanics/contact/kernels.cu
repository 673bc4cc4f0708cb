// Kernels of roughvisc.mechanics.contact.kernels: the passes of the contact solver on a GPU.
//
// Each thread works on some of the elements i < count. A kernel with sums ends with Totals::finish(), which adds up
// in the same order in each run, so that the sums have the same bits.

typedef long long Index;

#define EACH_ELEMENT                                                                                                   \
    for (Index i = blockIdx.x * (Index)blockDim.x + threadIdx.x; i < count; i += (Index)gridDim.x * blockDim.x)

// Cells of segment i. A segment is the part of a row of cells that lies in one block of the coarse grid.
#define EACH_CELL_OF_SEGMENT                                                                                           \
    for (Index row = i / my * ny, column = i % my, cell = row + (column * ny + my - 1) / my;                           \
         cell < row + ((column + 1) * ny + my - 1) / my; ++cell)

// Free cells k of block i; `ends` is the number of free cells up to the end of each segment.
#define EACH_FREE_CELL_OF_BLOCK                                                                                        \
    for (Index row = (i / my * nx + mx - 1) / mx; row < ((i / my + 1) * nx + mx - 1) / mx; ++row)                      \
        for (Index s = row * my + i % my, k = s ? ends[s - 1] : 0; k < ends[s]; ++k)

// Block of a cell. A grid has nx by ny cells and mx by my blocks.
#define BLOCK_OF(cell) ((cell) / ny * mx / nx * my + (cell) % ny * my / ny)

// The last arguments of a kernel with sums: sums of each block of threads, number of these blocks that have ended, and
// sums of all.
#define SUM_ARGUMENTS double *parts, unsigned *ended, double *results

// Combines a value of each thread of a block of threads.
static __device__ double combined(double* shared, double value, bool is_sum) {
    __syncthreads();
    shared[threadIdx.x] = value;
    for (int half = blockDim.x / 2; half > 0; half /= 2) {
        __syncthreads();
        if (threadIdx.x < half) {
            const double one = shared[threadIdx.x], other = shared[threadIdx.x + half];
            shared[threadIdx.x] = is_sum ? one + other : fmax(one, other);
        }
    }
    __syncthreads();
    return shared[0];
}

// Sums over the elements, followed by largest values.
template <int sums, int maxima = 0>
struct Totals {
    double values[sums + maxima];

    __device__ Totals() {
#pragma unroll
        for (int k = 0; k < sums + maxima; ++k) values[k] = k < sums ? 0 : -1.0 / 0.0;
    }

    __device__ void add(int k, double value) { values[k] += value; }

    __device__ void largest(int k, double value) { values[sums + k] = fmax(values[sums + k], value); }

    // Each block of threads adds up its threads; the one that ends last adds up all blocks.
    __device__ void finish(volatile double* parts, unsigned* ended, double* results) {
        __shared__ double shared[256];
        __shared__ bool is_last;
#pragma unroll  // keeps the values in registers
        for (int k = 0; k < sums + maxima; ++k) {
            const double value = combined(shared, values[k], k < sums);
            if (threadIdx.x == 0) parts[k * gridDim.x + blockIdx.x] = value;
        }
        if (threadIdx.x == 0) {
            __threadfence();
            is_last = atomicInc(ended, gridDim.x - 1) == gridDim.x - 1;
        }
        __syncthreads();
        if (!is_last) return;
        for (int k = 0; k < sums + maxima; ++k) {
            double value = k < sums ? 0 : -1.0 / 0.0;
            for (int i = threadIdx.x; i < gridDim.x; i += blockDim.x) {
                const double part = parts[k * gridDim.x + i];
                value = k < sums ? value + part : fmax(value, part);
            }
            value = combined(shared, value, k < sums);
            if (threadIdx.x == 0) results[k] = value;
        }
    }
};

// ---------------------------------------------------------------------------------------------------------- free cells

// Sum of the separation over the contact, and number of cells in contact, which are among the given cells.
extern "C" __global__ void contact_level(Index count, const double* pressure, const double* separation,
                                         const Index* cells, SUM_ARGUMENTS) {
    Totals<2> totals;
    EACH_ELEMENT {
        if (pressure[cells[i]] > 0) {
            totals.add(0, separation[cells[i]]);
            totals.add(1, 1);
        }
    }
    totals.finish(parts, ended, results);
}

// Whether a cell is free: it carries pressure, or it has material and penetrates.
static __device__ bool is_free(double pressure, double separation, double level, bool is_present) {
    return pressure > 0 || (separation < level && is_present);
}

// Number of free cells of each segment. Sums: free cells, contact cells, pressure, separation, pressure times
// separation and times gap; largest: approach, pressure, separation, negative separation.
extern "C" __global__ void find(Index count, const double* pressure, const double* separation, const bool* present,
                                Index is_whole, Index ny, Index my, const double* gap, const double* contact,
                                double given, Index under_load, Index* numbers, SUM_ARGUMENTS) {
    Totals<6, 4> totals;
    const double level = under_load ? contact[0] / contact[1] : given;
    totals.largest(0, level);
    EACH_ELEMENT {
        Index free = 0;
        EACH_CELL_OF_SEGMENT {
            const double p = pressure[cell], s = separation[cell];
            if (!is_free(p, s, level, is_whole || present[cell])) continue;
            ++free;
            totals.add(1, p > 0);
            totals.add(2, p);
            totals.add(3, s);
            totals.add(4, p * s);
            totals.add(5, p * gap[cell]);
            totals.largest(1, p);
            totals.largest(2, s);
            totals.largest(3, -s);
        }
        numbers[i] = free;
        totals.add(0, free);
    }
    totals.finish(parts, ended, results);
}

// The free cells in ascending order, their pressure, and their separation without a mean.
extern "C" __global__ void gather(Index count, const double* pressure, const double* separation, const bool* present,
                                  Index is_whole, Index ny, Index my, double level, double mean, const Index* ends,
                                  Index* cells, double* held, double* residual) {
    EACH_ELEMENT {
        Index k = i ? ends[i - 1] : 0;
        EACH_CELL_OF_SEGMENT {
            const double p = pressure[cell], s = separation[cell];
            if (!is_free(p, s, level, is_whole || present[cell])) continue;
            cells[k] = cell;
            held[k] = p;
            residual[k] = s - mean;
            ++k;
        }
    }
}

extern "C" __global__ void spread(Index count, double* field, const Index* cells, const double* values) {
    EACH_ELEMENT field[cells[i]] = values[i];
}

extern "C" __global__ void spread_single(Index count, float* field, const Index* cells, const double* values,
                                         double divisor) {
    EACH_ELEMENT field[cells[i]] = (float)(values[i] / divisor);
}

// ------------------------------------------------------------------------------------------------- conjugate gradients

// Sums from which `turn` takes the mean direction and its part along the last step.
extern "C" __global__ void against_last(Index count, const double* direction, const double* residual,
                                        const double* response, const double* last, const Index* cells, SUM_ARGUMENTS) {
    Totals<7> totals;
    EACH_ELEMENT {
        const double d = direction[i], r = residual[i], f = last[cells[i]], u = response[cells[i]];
        totals.add(0, d);
        totals.add(1, d * u);
        totals.add(2, u);
        totals.add(3, d * r);
        totals.add(4, r);
        totals.add(5, f);
        totals.add(6, f * r);
    }
    totals.finish(parts, ended, results);
}

// Makes the direction conjugate to the last step, if there is one and the direction still descends then. Sum: absolute
// values of the direction before this change.
extern "C" __global__ void turn(Index count, double* direction, const double* last, const Index* cells,
                                const double* sums, double curvature, Index under_load, SUM_ARGUMENTS) {
    Totals<1> totals;
    const double mean = under_load ? sums[0] / count : 0;
    double beta = 0, last_mean = 0;
    if (curvature > 0) {
        last_mean = under_load ? sums[5] / count : 0;
        beta = (sums[1] - mean * sums[2]) / curvature;
        const double descent = sums[3] - mean * sums[4] - beta * (sums[6] - last_mean * sums[4]);
        if (!(beta > 0 && descent > 0)) beta = 0;
    }
    EACH_ELEMENT {
        const double d = direction[i] - mean;
        direction[i] = beta > 0 ? d - beta * (last[cells[i]] - last_mean) : d;
        totals.add(0, fabs(d));
    }
    totals.finish(parts, ended, results);
}

// A step, cut at zero pressure. Sum: its pressure.
extern "C" __global__ void cut(Index count, const double* held, const double* direction, double length, double* trial,
                               SUM_ARGUMENTS) {
    Totals<1> totals;
    EACH_ELEMENT {
        trial[i] = fmax(held[i] - length * direction[i], 0.0);
        totals.add(0, trial[i]);
    }
    totals.finish(parts, ended, results);
}

// The step, scaled to a load if that is positive. Sum: slope of the energy; largest: pressure of `cut` over the load.
extern "C" __global__ void scale(Index count, const double* held, const double* residual, const double* carried,
                                 double load, double* trial, double* change, SUM_ARGUMENTS) {
    Totals<1, 1> totals;
    const double ratio = load > 0 ? carried[0] / load : 1;
    totals.largest(0, ratio);
    EACH_ELEMENT {
        trial[i] = ratio > 0 ? trial[i] / ratio : 0;
        change[i] = trial[i] - held[i];
        totals.add(0, change[i] * residual[i]);
    }
    totals.finish(parts, ended, results);
}

// Sum: curvature of the energy; largest: whether a cell is emptied, and part of its pressure that a cell loses.
extern "C" __global__ void line_search(Index count, const double* held, const double* trial, const double* change,
                                       const double* response, const Index* cells, SUM_ARGUMENTS) {
    Totals<1, 2> totals;
    EACH_ELEMENT {
        const double h = held[i], c = change[i];
        totals.add(0, c * response[cells[i]]);
        totals.largest(0, h > 0 && trial[i] == 0);
        totals.largest(1, c < 0 ? -c / h : 0);
    }
    totals.finish(parts, ended, results);
}

extern "C" __global__ void put(Index count, double* pressure, const Index* cells, const double* held,
                               const double* trial, const double* change, double fraction) {
    EACH_ELEMENT pressure[cells[i]] = fraction == 1 ? trial[i] : fmax(held[i] + fraction * change[i], 0.0);
}

extern "C" __global__ void add(Index count, double* field, const double* change, double fraction) {
    EACH_ELEMENT field[i] += fraction * change[i];
}

// ----------------------------------------------------------------------------------------------------- blocks of cells

// Number, pressure and residual of the free cells of each block.
extern "C" __global__ void block_sums(Index count, const double* held, const double* residual, const Index* ends,
                                      Index nx, Index ny, Index mx, Index my, double* free, double* loads,
                                      double* left) {
    EACH_ELEMENT {
        double number = 0, load = 0, total = 0;
        EACH_FREE_CELL_OF_BLOCK {
            number += 1;
            load += held[k];
            total += residual[k];
        }
        free[i] = number;
        loads[i] = load;
        left[i] = total;
    }
}

// Sums: load times displacement, squared load over the free cells, and free cells of full blocks.
extern "C" __global__ void spot_sums(Index count, const double* loads, const double* displaced, const double* free,
                                     double full, SUM_ARGUMENTS) {
    Totals<3> totals;
    EACH_ELEMENT {
        totals.add(0, loads[i] * displaced[i]);
        totals.add(1, loads[i] * loads[i] / fmax(free[i], 1.0));
        totals.add(2, free[i] > full ? free[i] : 0);
    }
    totals.finish(parts, ended, results);
}

// Residual without its mean over each block.
extern "C" __global__ void rest(Index count, const double* residual, const double* left, const double* free,
                                const Index* cells, Index nx, Index ny, Index mx, Index my, double* found) {
    EACH_ELEMENT {
        const Index block = BLOCK_OF(cells[i]);
        found[i] = residual[i] - left[block] / free[block];
    }
}

// Sum of a field over the free cells of each block.
extern "C" __global__ void field_sums(Index count, const float* field, double factor, const Index* cells,
                                      const Index* ends, Index nx, Index ny, Index mx, Index my, double* found) {
    EACH_ELEMENT {
        found[i] = 0;
        EACH_FREE_CELL_OF_BLOCK found[i] += factor * field[cells[k]];
    }
}

// A field without its mean over the free cells of each block, plus a pressure of each block.
extern "C" __global__ void join(Index count, const float* field, double factor, const double* eased,
                                const double* total, const double* free, const Index* cells, Index nx, Index ny,
                                Index mx, Index my, double* direction) {
    EACH_ELEMENT {
        const Index block = BLOCK_OF(cells[i]);
        direction[i] = factor * field[cells[i]] + (eased[block] - total[block] / free[block]);
    }
}

// Residual that a search direction `eased` removes. Sum: its product with the direction.
extern "C" __global__ void respond(Index count, const double* displaced, const double* eased, const double* free,
                                   double local, double* response, SUM_ARGUMENTS) {
    Totals<1> totals;
    EACH_ELEMENT {
        response[i] = free[i] * (displaced[i] + local * eased[i]);
        totals.add(0, eased[i] * response[i]);
    }
    totals.finish(parts, ended, results);
}

// An iteration of the conjugate gradients of Chronopoulos and Gear. Sum: residual times preconditioned residual, which
// is also given from the last step, the one before and the first; largest: length of the step. A step has no length if
// the sum is small already.
extern "C" __global__ void step(Index count, const double* response, const double* free, double local, double own,
                                double part, const double* curvature, const double* last, const double* before,
                                const double* first, double enough, double* found, double* search, double* moved,
                                double* left, double* eased, double* loads, SUM_ARGUMENTS) {
    Totals<1, 1> totals;
    const double ratio = before[0] > 0 ? last[0] / before[0] : 0;
    const double bend = curvature[0] - (ratio > 0 ? ratio * last[0] / last[1] : 0);
    const double length = last[0] > enough * first[0] ? last[0] / bend : 0;
    totals.largest(0, length);
    EACH_ELEMENT {
        search[i] = eased[i] + ratio * search[i];
        moved[i] = response[i] + ratio * moved[i];
        found[i] += length * search[i];
        left[i] -= length * moved[i];
        const double n = free[i];
        eased[i] = left[i] / (n > 0 ? n * local + n * n * own : 1);
        loads[i] = n * eased[i] * part;
        totals.add(0, left[i] * eased[i]);
    }
    totals.finish(parts, ended, results);
}
