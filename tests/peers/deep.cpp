// Writes a deep EXR file from samples: deep WIDTH HEIGHT IN.deep OUT.exr
//
// In IN.deep stand, for every pixel, a u32 number of samples and five floats for each: Z, A, R, G, B.

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfHeader.h>
#include <ImfPartType.h>
#include <half.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <vector>

int main(int, char** argv) {
    using namespace Imf;
    const int width = std::atoi(argv[1]), height = std::atoi(argv[2]);
    std::ifstream in(argv[3], std::ios::binary);
    Header header(width, height);
    header.setType(DEEPSCANLINE);
    header.compression() = ZIPS_COMPRESSION;
    const char* names[4] = {"A", "R", "G", "B"};
    for (const char* name : names) header.channels().insert(name, Channel(HALF));
    header.channels().insert("Z", Channel(FLOAT));
    DeepScanLineOutputFile file(argv[4], header);
    std::vector<uint32_t> counts(width);
    std::vector<std::vector<float>> z(width);
    std::vector<std::vector<half>> channels[4];
    for (auto& channel : channels) channel.resize(width);
    std::vector<char*> z_at(width);
    std::vector<std::vector<char*>> at(4, std::vector<char*>(width));
    for (int row = 0; row < height; row++) {
        for (int x = 0; x < width; x++) {
            in.read(reinterpret_cast<char*>(&counts[x]), 4);
            z[x].resize(counts[x]);
            for (auto& channel : channels) channel[x].resize(counts[x]);
            for (uint32_t i = 0; i < counts[x]; i++) {
                float sample[5];
                in.read(reinterpret_cast<char*>(sample), sizeof sample);
                z[x][i] = sample[0];
                for (int c = 0; c < 4; c++) channels[c][x][i] = half(sample[c + 1]);
            }
            z_at[x] = reinterpret_cast<char*>(z[x].data());
            for (int c = 0; c < 4; c++) at[c][x] = reinterpret_cast<char*>(channels[c][x].data());
        }
        DeepFrameBuffer frame;
        frame.insertSampleCountSlice(Slice(UINT, reinterpret_cast<char*>(counts.data()), 4, 0));
        for (int c = 0; c < 4; c++)
            frame.insert(names[c], DeepSlice(HALF, reinterpret_cast<char*>(at[c].data()), sizeof(char*), 0, sizeof(half)));
        frame.insert("Z", DeepSlice(FLOAT, reinterpret_cast<char*>(z_at.data()), sizeof(char*), 0, sizeof(float)));
        file.setFrameBuffer(frame);
        file.writePixels(1);
    }
}
