// Supersampling by Embree: what a picture of the same accuracy costs by rays.
//
//     embree FOLDER REFERENCE_SAMPLES STRIDE PICTURE.rgb ...
//
// Reads town.tri and view.txt. Makes a reference on every STRIDE-th pixel of both axes, from
// REFERENCE_SAMPLES stratified samples each; prints the RMSE of the given pictures against it; then, for
// growing numbers of samples, the seconds for building the tree and for tracing all pixels, and the RMSE.

#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>
#include <thread>
#include <vector>

struct View {
    int width, height;
    double eye[3], corner[3], right[3], down[3];
};

static std::vector<float> floats(const std::string& path) {
    std::ifstream in(path, std::ios::binary | std::ios::ate);
    if (!in) { std::fprintf(stderr, "%s is not there\n", path.c_str()); std::exit(1); }
    std::vector<float> values(size_t(in.tellg()) / 4);
    in.seekg(0);
    in.read(reinterpret_cast<char*>(values.data()), values.size() * 4);
    return values;
}

static double now() {
    using namespace std::chrono;
    return duration<double>(steady_clock::now().time_since_epoch()).count();
}

// A number in [0, 1) from two others, different for different ones.
static float hashed(uint32_t a, uint32_t b) {
    uint32_t h = a * 0x9e3779b1u ^ (b + 0x7f4a7c15u) * 0x85ebca6bu;
    h ^= h >> 15; h *= 0x2c1b3c6du; h ^= h >> 12; h *= 0x297a2d39u; h ^= h >> 15;
    return float(h >> 8) / float(1 << 24);
}

// The i-th of n samples of a pixel: jittered on a square grid if n is a square, otherwise the R2 sequence turned
// by chance.
static void sample(int i, int n, int side, uint32_t pixel, float& x, float& y) {
    if (side * side == n) {
        x = (i % side + hashed(pixel, 2 * i)) / side;
        y = (i / side + hashed(pixel, 2 * i + 1)) / side;
    } else {
        double u = hashed(pixel, 0) + 0.7548776662466927 * i, v = hashed(pixel, 1) + 0.5698402909980532 * i;
        x = float(u - std::floor(u));
        y = float(v - std::floor(v));
    }
}

// Colours of every stride-th pixel by n samples each, eight rays at a time.
static void trace(RTCScene scene, const View& view, const float* colors, int n, int stride, std::vector<float>& out) {
    const int columns = (view.width + stride - 1) / stride, rows = (view.height + stride - 1) / stride;
    const int side = int(std::lround(std::sqrt(double(n))));
    out.assign(size_t(columns) * rows * 3, 0.0f);
    std::atomic<int> next{0};
    auto work = [&] {
        for (int row; (row = next++) < rows;) {
            std::vector<double> sums(size_t(columns) * 3, 0.0);
            alignas(64) RTCRayHit8 rays;
            alignas(32) int valid[8];
            int column_of[8], filled = 0;
            auto shoot = [&] {
                for (int i = 0; i < 8; i++) valid[i] = i < filled ? -1 : 0;
                RTCIntersectContext context;
                rtcInitIntersectContext(&context);
                context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
                rtcIntersect8(valid, scene, &context, &rays);
                for (int i = 0; i < filled; i++) {
                    if (rays.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
                    const float* color = colors + size_t(rays.hit.primID[i]) * 3;
                    for (int c = 0; c < 3; c++) sums[size_t(column_of[i]) * 3 + c] += color[c];
                }
                filled = 0;
            };
            for (int column = 0; column < columns; column++) {
                const uint32_t pixel = uint32_t(row * stride) * uint32_t(view.width) + uint32_t(column * stride);
                for (int i = 0; i < n; i++) {
                    float dx, dy;
                    sample(i, n, side, pixel, dx, dy);
                    const double x = column * stride + dx, y = row * stride + dy;
                    float direction[3];
                    for (int c = 0; c < 3; c++)
                        direction[c] = float(view.corner[c] + x * view.right[c] + y * view.down[c]);
                    rays.ray.org_x[filled] = float(view.eye[0]);
                    rays.ray.org_y[filled] = float(view.eye[1]);
                    rays.ray.org_z[filled] = float(view.eye[2]);
                    rays.ray.dir_x[filled] = direction[0];
                    rays.ray.dir_y[filled] = direction[1];
                    rays.ray.dir_z[filled] = direction[2];
                    rays.ray.tnear[filled] = 0;
                    rays.ray.tfar[filled] = std::numeric_limits<float>::infinity();
                    rays.ray.time[filled] = 0;
                    rays.ray.mask[filled] = ~0u;
                    rays.ray.flags[filled] = 0;
                    rays.hit.geomID[filled] = RTC_INVALID_GEOMETRY_ID;
                    rays.hit.instID[0][filled] = RTC_INVALID_GEOMETRY_ID;
                    column_of[filled] = column;
                    if (++filled == 8) shoot();
                }
            }
            if (filled) shoot();
            for (int i = 0; i < columns * 3; i++) out[size_t(row) * columns * 3 + i] = float(sums[i] / n);
        }
    };
    std::vector<std::thread> threads;
    for (unsigned i = 0; i < std::max(1u, std::thread::hardware_concurrency()); i++) threads.emplace_back(work);
    for (auto& thread : threads) thread.join();
}

int main(int argc, char** argv) {
    const std::string folder = argv[1];
    const int samples = std::atoi(argv[2]), stride = std::atoi(argv[3]);
    View view;
    std::ifstream text(folder + "/view.txt");
    text >> view.width >> view.height;
    for (double* v : {view.eye, view.corner, view.right, view.down}) text >> v[0] >> v[1] >> v[2];
    const std::vector<float> town = floats(folder + "/town.tri");
    const size_t count = town.size() / 12;
    std::vector<float> colors(count * 3);
    for (size_t i = 0; i < count; i++) std::copy_n(&town[i * 12 + 9], 3, &colors[i * 3]);

    RTCDevice device = rtcNewDevice(nullptr);
    auto build = [&] {
        RTCScene scene = rtcNewScene(device);
        RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
        auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, count * 3));
        auto* corners = static_cast<uint32_t*>(rtcSetNewGeometryBuffer(
            geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, count));
        for (size_t i = 0; i < count; i++) std::copy_n(&town[i * 12], 9, points + i * 9);
        for (size_t i = 0; i < count * 3; i++) corners[i] = uint32_t(i);
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene, geometry);
        rtcReleaseGeometry(geometry);
        rtcCommitScene(scene);
        return scene;
    };
    double best = 1e9;
    RTCScene scene = nullptr;
    for (int run = 0; run < 3; run++) {
        if (scene) rtcReleaseScene(scene);
        const double clock = now();
        scene = build();
        best = std::min(best, now() - clock);
    }
    std::printf("{\"triangles\": %zu, \"build\": %.6f}\n", count, best);

    std::vector<float> reference, pixels;
    trace(scene, view, colors.data(), samples, stride, reference);
    const int columns = (view.width + stride - 1) / stride, rows = (view.height + stride - 1) / stride;
    auto rmse = [&](const std::vector<float>& picture, int step, int width) {
        double sum = 0;
        for (int row = 0; row < rows; row++)
            for (int column = 0; column < columns; column++)
                for (int c = 0; c < 3; c++) {
                    const double d = double(picture[(size_t(row) * step * width + size_t(column) * step) * 3 + c]) -
                                     reference[(size_t(row) * columns + column) * 3 + c];
                    sum += d * d;
                }
        return std::sqrt(sum / (double(rows) * columns * 3));
    };
    for (int i = 4; i < argc; i++)
        std::printf("{\"picture\": \"%s\", \"rmse\": %.7f}\n", argv[i], rmse(floats(argv[i]), stride, view.width));
    std::fflush(stdout);
    // All pixels are traced for time, or a share of them if that takes long; errors are those of the same
    // pixels as the reference's.
    double spent = 0;
    for (int side = 1; side <= 24 && spent < 60; side = side < 8 ? side + 1 : side + side / 4) {
        const int n = side * side;
        const int share = n <= 64 ? 1 : 2;
        double clock = now();
        std::vector<float> all;
        trace(scene, view, colors.data(), n, share, all);
        const double seconds = (now() - clock) * share * share;
        spent += seconds / (share * share);
        trace(scene, view, colors.data(), n, stride, pixels);
        std::printf("{\"samples\": %d, \"trace\": %.6f, \"rmse\": %.7f}\n", n, seconds, rmse(pixels, 1, columns));
        std::fflush(stdout);
    }
}
