// Plan: files that the HDF5 library writes come back value for value: every type, byte order and
// arrangement. Then the choice of a dataset and a component, spacing, and damaged files.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/run_program.h"
#include "esvr/error.h"
#include "images/image_source.h"
#include "samples/hdf5_writer.h"
#include "samples/whole_image.h"

namespace esvr::samples {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

template <class T>
void expectHdf5Reads(hid_t type, hid_t memoryType, std::optional<double> maximum) {
  const TemporaryFolder folder;
  const auto values = countingValues<T>(2 * 3 * 5);
  Hdf5Writer(folder / "a.h5").add("/a", {5, 3, 2}, type, memoryType, values.data());
  const auto image = openHdf5(folder / "a.h5", {});
  EXPECT_EQ(image->size(), (Coord{2, 3, 5}));
  EXPECT_EQ(image->typeMaximum(), maximum);
  EXPECT_EQ(wholeImage(*image), asFloats(values));
}

TEST(OpenHdf5, readsEveryTypeInBothByteOrders) {
  expectHdf5Reads<std::uint8_t>(H5T_STD_U8LE, H5T_NATIVE_UINT8, 255.0);
  expectHdf5Reads<std::int8_t>(H5T_STD_I8LE, H5T_NATIVE_INT8, 127.0);
  expectHdf5Reads<std::uint16_t>(H5T_STD_U16LE, H5T_NATIVE_UINT16, 65535.0);
  expectHdf5Reads<std::uint16_t>(H5T_STD_U16BE, H5T_NATIVE_UINT16, 65535.0);
  expectHdf5Reads<std::int16_t>(H5T_STD_I16LE, H5T_NATIVE_INT16, 32767.0);
  expectHdf5Reads<std::int16_t>(H5T_STD_I16BE, H5T_NATIVE_INT16, 32767.0);
  expectHdf5Reads<std::uint32_t>(H5T_STD_U32LE, H5T_NATIVE_UINT32, 4294967295.0);
  expectHdf5Reads<std::int32_t>(H5T_STD_I32BE, H5T_NATIVE_INT32, 2147483647.0);
  expectHdf5Reads<std::uint64_t>(H5T_STD_U64LE, H5T_NATIVE_UINT64, 18446744073709551615.0);
  expectHdf5Reads<std::int64_t>(H5T_STD_I64BE, H5T_NATIVE_INT64, 9223372036854775807.0);
  expectHdf5Reads<float>(H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, std::nullopt);
  expectHdf5Reads<float>(H5T_IEEE_F32BE, H5T_NATIVE_FLOAT, std::nullopt);
  expectHdf5Reads<double>(H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, std::nullopt);
  expectHdf5Reads<double>(H5T_IEEE_F64BE, H5T_NATIVE_DOUBLE, std::nullopt);
}

TEST(OpenHdf5, readsTruthValues) {
  const TemporaryFolder folder;
  const hid_t truth = H5Tenum_create(H5T_NATIVE_INT8);
  for (const bool isTrue : {false, true}) {
    const std::int8_t value = isTrue;
    H5Tenum_insert(truth, isTrue ? "TRUE" : "FALSE", &value);
  }
  const std::int8_t values[] = {0, 1, 1, 0};
  Hdf5Writer(folder / "a.h5").add("/mask", {1, 2, 2}, truth, truth, values);
  H5Tclose(truth);
  EXPECT_THAT(wholeImage(*openHdf5(folder / "a.h5", {})), ElementsAre(0, 1, 1, 0));
}

TEST(OpenHdf5, readsCompressedParts) {
  const TemporaryFolder folder;
  const auto values = countingValues<std::uint16_t>(20 * 9 * 7);
  Hdf5Writer(folder / "a.h5")
      .add("/a", {20, 9, 7}, H5T_STD_U16LE, H5T_NATIVE_UINT16, values.data(), {6, 4, 3});
  const auto image = openHdf5(folder / "a.h5", {});
  EXPECT_EQ(wholeImage(*image), asFloats(values));
}

TEST(OpenHdf5, takesTheOnlyVolumeAndListsSeveral) {
  const TemporaryFolder folder;
  {
    Hdf5Writer file(folder / "a.h5");
    file.addBytes("/axis", {4}, "abcd");
    file.addBytes("/group/volume", {1, 2, 2}, "abcd");
  }
  EXPECT_EQ(wholeImage(*openHdf5(folder / "a.h5", {})).front(), float('a'));
  {
    Hdf5Writer file(folder / "b.h5");
    file.addBytes("/x", {1, 2, 2}, "abcd");
    file.addBytes("/y/z", {2, 2, 1}, "efgh");
  }
  EXPECT_THAT([&] { (void)openHdf5(folder / "b.h5", {}); },
              ThrowsMessage<UsageError>(AllOf(HasSubstr("b.h5"), HasSubstr("--dataset"),
                                              HasSubstr("/x (1 x 2 x 2 uint8)"),
                                              HasSubstr("/y/z (2 x 2 x 1 uint8)"))));
  EXPECT_EQ(wholeImage(*openHdf5(folder / "b.h5", {.dataset = "y/z"})).front(), float('e'));
  EXPECT_THAT([&] { (void)openHdf5(folder / "b.h5", {.dataset = "/w"}); },
              ThrowsMessage<UsageError>(AllOf(HasSubstr("no dataset '/w'"), HasSubstr("/y/z"))));
}

TEST(OpenHdf5, refusesWhatIsNoVolumeOfNumbers) {
  const TemporaryFolder folder;
  {
    Hdf5Writer file(folder / "a.h5");
    file.addBytes("/flat", {2, 2}, "abcd");
    const hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, 2);
    file.add("/text", {1, 1, 2}, text, text, "abcd");
    H5Tclose(text);
  }
  for (const char* name : {"/flat", "/text"})
    EXPECT_THAT(
        [&] { (void)openHdf5(folder / "a.h5", {.dataset = name}); },
        ThrowsMessage<BadInput>(AllOf(HasSubstr("a.h5"), HasSubstr(name), HasSubstr("no volume"))));
  Hdf5Writer(folder / "empty.h5");
  EXPECT_THAT([&] { (void)openHdf5(folder / "empty.h5", {}); },
              ThrowsMessage<UsageError>(HasSubstr("no dataset")));
}

TEST(OpenHdf5, takesComponentsFromTheShorterOneOfTheFirstAndTheLastAxis) {
  const TemporaryFolder folder;
  {
    Hdf5Writer file(folder / "a.h5");
    file.addBytes("/first", {2, 3, 1, 4}, "abcdefghijklABCDEFGHIJKL");
    file.addBytes("/last", {4, 1, 3, 2}, "aAbBcCdDeEfFgGhHiIjJkKlL");
    file.addBytes("/ones", {1, 1, 2, 1, 2}, "abcd");
  }
  for (const char* name : {"/first", "/last"}) {
    const auto image = openHdf5(folder / "a.h5", {.component = 1, .dataset = name});
    EXPECT_EQ(image->size(), name == std::string("/first") ? (Coord{4, 1, 3}) : (Coord{3, 1, 4}));
    const auto values = wholeImage(*image);
    for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(values[i], float('A' + int(i))) << name;
    EXPECT_THAT([&] { (void)openHdf5(folder / "a.h5", {.dataset = name}); },
                ThrowsMessage<UsageError>(HasSubstr("2 components")));
  }
  EXPECT_EQ(openHdf5(folder / "a.h5", {.dataset = "/ones"})->size(), (Coord{2, 1, 2}));
}

TEST(OpenHdf5, takesTheEdgesOfVoxels) {
  const TemporaryFolder folder;
  {
    Hdf5Writer file(folder / "a.h5");
    file.addBytes("/a", {1, 2, 2}, "abcd");
    file.addSize("/a", {3.0, 2.0, 0.5});
    file.addBytes("/b", {1, 2, 2}, "abcd");
    file.addSize("/b", {3.0, 2.0});
  }
  const auto m = openHdf5(folder / "a.h5", {.dataset = "/a"})->indexToWorld();
  EXPECT_THAT((std::array{m[0], m[5], m[10]}), ElementsAre(0.5, 2.0, 3.0));
  EXPECT_EQ(openHdf5(folder / "a.h5", {.dataset = "/b"})->indexToWorld()[0], 1.0)
      << "it has not three numbers";
}

TEST(OpenHdf5, namesTheFileThatIsCut) {
  const TemporaryFolder folder;
  const auto values = countingValues<std::uint16_t>(20 * 9 * 7);
  Hdf5Writer(folder / "a.h5")
      .add("/a", {20, 9, 7}, H5T_STD_U16LE, H5T_NATIVE_UINT16, values.data(), {6, 4, 3});
  const std::string whole = test::readText(folder / "a.h5");
  for (std::size_t length = 0; length < whole.size(); length += 101) {
    test::writeText(folder / "cut.h5", whole.substr(0, length));
    EXPECT_THAT([&] { (void)wholeImage(*openHdf5(folder / "cut.h5", {})); },
                ThrowsMessage<BadInput>(HasSubstr("cut.h5")))
        << length;
  }
}

TEST(OpenHdf5, refusesSizesThatDoNotFitIntoMemory) {
  const TemporaryFolder folder;
  {
    const hid_t file =
        H5Fcreate((folder / "a.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hsize_t axes[] = {1, 2'000'000'000, 2'000'000'000}, chunk[] = {1, 1, 1};
    const hid_t space = H5Screate_simple(3, axes, nullptr),
                properties = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(properties, 3, chunk);
    H5Dclose(H5Dcreate2(file, "/a", H5T_STD_U8LE, space, H5P_DEFAULT, properties, H5P_DEFAULT));
    H5Pclose(properties);
    H5Sclose(space);
    H5Fclose(file);
  }
  EXPECT_THAT([&] { (void)openHdf5(folder / "a.h5", {}); },
              ThrowsMessage<MemoryExceeded>(HasSubstr("a.h5")));
}

}  // namespace
}  // namespace esvr::samples
