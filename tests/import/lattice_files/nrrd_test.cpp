#include <fmt/format.h>
#include <zlib.h>

#include "base/text/byte_order.h"
#include "tests/import/voxel_support.h"
#include "tools/import/lattice_files/lattice_files.h"

namespace tensorray {
namespace {

const std::string oblique_fields = "space directions: none (0,2,0) (-1.5,0,0) (0,0.5,3)\nspace origin: (10,20,30)\n";

/// The header of a single-precision file. `fields` are further lines.
std::string header_of(const std::string& kind, int components, const Vector3i& size, const std::string& fields,
                      const std::string& space = "right-anterior-superior") {
  return fmt::format(
      "NRRD0005\ntype: float\ndimension: 4\nspace: {}\nsizes: {} {} {} {}\nkinds: {} space space space\n"
      "endian: little\nencoding: raw\n{}\n",
      space, components, size.x(), size.y(), size.z(), kind, fields);
}

/// The header line of a measurement frame. Its vectors are the columns of `frame`.
std::string measurement_frame(const Matrix3d& frame) {
  const auto vector = [&](int i) { return fmt::format("({},{},{})", frame(0, i), frame(1, i), frame(2, i)); };
  return "measurement frame: " + vector(0) + " " + vector(1) + " " + vector(2) + "\n";
}

Matrix3d read_one(const std::string& header, const std::vector<float>& components) {
  const Temporary file("one.nrrd", header + test::bytes_of(components));
  return test::first_tensor(test::tensors_of(open_nrrd(file)));
}

TEST(Nrrd, EachKindHasItsComponentsOrderAndMask) {
  const Matrix3d symmetric = test::symmetric_tensor(), general = test::general_tensor();
  struct Row {
    const char* kind;
    std::optional<float> mask;
    const Matrix3d& tensor;
    bool is_full = false;
  };
  for (const Row& row : {Row{"3D-symmetric-matrix", {}, symmetric},
                         {"3D-masked-symmetric-matrix", 1, symmetric},
                         {"3D-masked-symmetric-matrix", 0, symmetric},
                         {"???", 1, symmetric},
                         {"3D-matrix", {}, general, true},
                         {"3D-masked-matrix", 1, general, true},
                         {"3D-masked-matrix", 0, general, true}}) {
    std::vector<float> components = row.is_full ? test::rows(row.tensor) : test::upper_triangle(row.tensor);
    if (row.mask) components.insert(components.begin(), *row.mask);
    const Matrix3d found =
        read_one(header_of(row.kind, static_cast<int>(components.size()), {1, 1, 1}, oblique_fields), components);
    if (row.mask == 0)
      EXPECT_TRUE(found.hasNaN()) << row.kind;
    else
      EXPECT_LT((found - row.tensor).norm(), 1e-6) << row.kind;
  }
  const std::string list = header_of("list", 6, {1, 1, 1}, oblique_fields);
  test::expect_error([&] { read_one(list, test::upper_triangle(symmetric)); }, {"--order"});
}

TEST(Nrrd, AnatomicalSpacesAreTurnedToRasWithTheMeasurementFrame) {
  const Matrix3d frame = test::rotation(), t = test::general_tensor();
  const std::string fields = oblique_fields + measurement_frame(frame);
  // The vectors in the file are columns.
  const Matrix3d directions = (Matrix3d() << 0, -1.5, 0, 2, 0, 0.5, 0, 0, 3).finished();
  const std::vector<std::pair<std::string, Vector3d>> spaces = {{"right-anterior-superior", {1, 1, 1}},
                                                                {"left-anterior-superior", {-1, 1, 1}},
                                                                {"left-posterior-superior", {-1, -1, 1}},
                                                                {"scanner-xyz", {1, 1, 1}}};
  for (const auto& [space, signs] : spaces) {
    const Temporary file("space.nrrd",
                         header_of("3D-matrix", 9, {1, 1, 1}, fields, space) + test::bytes_of(test::rows(t)));
    const TensorGrid grid = test::tensors_of(open_nrrd(file));
    const Matrix3d turn = signs.asDiagonal();
    EXPECT_LT((grid.to_world.linear() - turn * directions).norm(), 1e-9) << space;
    EXPECT_LT((grid.to_world.translation() - turn * Vector3d(10, 20, 30)).norm(), 1e-9) << space;
    test::expect_near(turn * frame * t * frame.transpose() * turn, find(grid, {0, 0, 0}), 1e-5);
  }
}

TEST(Nrrd, ComponentsMayStandAnywhereAmongTheAxes) {
  // Some programs write components last: x fastest, then y, z, component.
  const Vector3i size(3, 2, 10);
  std::vector<float> numbers;
  for (int c = 0; c < 6; ++c)
    for (int i = 0; i < size.prod(); ++i) numbers.push_back(static_cast<float>(100 * (c + 1) + i));
  const Temporary file("last.nrrd",
                       "NRRD0005\ntype: float\ndimension: 4\nspace dimension: 3\nsizes: 3 2 10 6\nkinds: space space "
                       "space 3D-symmetric-matrix\nendian: little\nencoding: raw\nspace directions: (1,0,0) (0,1,0) "
                       "(0,0,1) none\n\n" +
                           test::bytes_of(numbers));
  const TensorGrid grid = test::tensors_of(open_nrrd(file));
  EXPECT_EQ(grid.active_voxels(), 60u);
  for_each_active(grid, [](const Vector3i& i, const Matrix3f& tensor) {
    const Matrix3d first = test::symmetric({100, 200, 300, 400, 500, 600});
    EXPECT_EQ(tensor.cast<double>(), (first.array() + i.dot(Vector3i(1, 3, 6))).matrix());
  });
}

TEST(Nrrd, SpacingsAndMinimaPlaceVoxelsByTheirCentering) {
  const auto transform = [](const std::string& centering) {
    const Temporary file(
        "spacing.nrrd",
        "NRRD0005\ntype: float\ndimension: 4\nsizes: 9 1 1 1\nkinds: 3D-matrix domain domain domain\n"
        "endian: little\nencoding: raw\nspacings: nan 2 3 4\naxis mins: nan 10 20 30\ncenterings: ??? " +
            centering + "\n\n" + test::bytes_of(std::vector<float>(9, 1)));
    return open_nrrd(file).to_world;
  };
  EXPECT_EQ(transform("node node node").linear(), Matrix3d(Vector3d(2, 3, 4).asDiagonal()));
  EXPECT_EQ(transform("node node node").translation(), Vector3d(10, 20, 30));
  EXPECT_EQ(transform("cell cell cell").translation(), Vector3d(11, 21.5, 32));
}

TEST(Nrrd, TextDetachedDataAndIntegersAreRead) {
  const std::string fields =
      "NRRD0005\ntype: short\ndimension: 4\nspace dimension: 3\nsizes: 6 1 1 2\nkinds: "
      "3D-symmetric-matrix space space space\nspace directions: none (1,0,0) (0,1,0) (0,0,1)\n";
  const auto expect = [](const std::filesystem::path& path) {
    const TensorGrid grid = test::tensors_of(open_nrrd(path));
    EXPECT_EQ(grid.active_voxels(), 1u);  // Exactly zero is background.
    test::expect_near(test::symmetric({1, 2, 3, 4, 5, -6}), find(grid, {0, 0, 1}));
  };
  const Temporary text("text.nrrd", fields + "encoding: ascii\n\n0 0 0 0 0 0\n1 2 3 4 5 -6\n");
  expect(text);
  std::string big(12, '\0');
  for (const int n : {1, 2, 3, 4, 5, -6}) (big += static_cast<char>(n < 0 ? -1 : 0)) += static_cast<char>(n);
  const Temporary raw("data.raw", big);
  const Temporary head("head.nhdr",
                       fields + "endian: big\nencoding: raw\ndata file: " + raw.filename().string() + "\n");
  expect(head);
  std::filesystem::remove(raw);
  test::expect_error([&] { open_nrrd(head); }, {"head.nhdr", "data.raw"});
}

TEST(Nrrd, WrongFilesAreErrorsOfOneLine) {
  const std::string numbers(9 * 8 * 4, '\1');
  const auto expect = [](const std::string& bytes, const std::vector<std::string>& words) {
    test::refuses(open_nrrd, "wrong.nrrd", bytes, words);
  };
  test::expect_error([] { open_nrrd("absent.nrrd"); }, {"absent.nrrd", "no such file"});
  for (const char* other : {"", "P6\n1 1\n255\n...", "1 2 3\n4 5 6\n"}) expect(other, {"not a NRRD"});
  for (const char* fields : {"type: float\ndimension: 4\n", "type: colour\n\n"})
    expect(std::string("NRRD0005\n") + fields, {"damaged"});
  const auto sized = [](const Vector3i& size, const std::string& fields = oblique_fields) {
    return header_of("3D-matrix", 9, size, fields);
  };
  const Vector3i two(2, 2, 2);
  for (const std::size_t gone : {1, 200}) expect(sized(two) + numbers.substr(gone), {"cut off"});
  expect(sized({20000, 20000, 20000}) + numbers, {"cut off"});
  expect(sized({2, 2, 0}) + numbers, {"damaged"});
  expect(header_of("3D-matrix", 6, two, oblique_fields) + numbers, {});
  expect(header_of("list", 8, two, oblique_fields) + numbers, {"8 components"});
  expect(sized(two, "space directions: none (1,0,0) (2,0,0) (0,0,1)\n") + numbers, {"space directions", "inverted"});
  const std::string frame = "measurement frame: (1,0,0) (0,0,0) (0,0,1)\n";
  expect(sized(two, oblique_fields + frame) + numbers, {"measurement frame"});
  expect(sized(two, oblique_fields + "data file: s%s%d 1 9 1\n"), {"several files"});
  expect(sized(two, oblique_fields + "Data File: -\n"), {"standard input"});
  expect("NRRD0005\ntype: float\ndimension: 3\nsizes: 2 2 2\nencoding: raw\nendian: little\n\n" + numbers, {"axes"});
}

TEST(Nrrd, TheFrameOfComponentsIsGivenWhereTheFileDoesNotStateIt) {
  const Matrix3d t = test::symmetric_tensor(), flip = Vector3d(-1, 1, 1).asDiagonal();
  const std::string lps = "left-posterior-superior",
                    directions = "space directions: none (2,0,0) (0,-2,0) (0,0,3)\n";  // in RAS: (−2, 0, 0) (0, 2, 0)
  const auto take = [&](const std::string& header) {
    const Temporary file("frame.nrrd", header + test::bytes_of(test::upper_triangle(t)));
    Lattice lattice = open_nrrd(file);
    take_frame(lattice, ComponentFrame::voxels);
    return test::tensors_of(lattice);
  };
  const auto header = [&](const std::string& fields, const std::string& space) {
    return header_of("3D-symmetric-matrix", 6, {1, 1, 1}, directions + fields, space);
  };
  test::expect_near(flip * t * flip, find(take(header("", lps)), {0, 0, 0}));
  for (const std::string& stated : {header(measurement_frame(Matrix3d::Identity()), lps), header("", "scanner-xyz")})
    test::expect_error([&] { take(stated); }, {"--frame"});
}

/// A header of single-precision numbers; `fields` are further lines.
std::string header_of(int channels, const Vector3i& size, const std::string& fields = "",
                      const std::string& type = "MET_FLOAT", const std::string& file = "LOCAL") {
  return fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\n{}DimSize = {} {} {}\nElementNumberOfChannels = {}\n"
      "ElementType = {}\nElementDataFile = {}\n",
      fields, size.x(), size.y(), size.z(), channels, type, file);
}

/// 2 × 1 × 1 voxels: a tensor, and its half.
std::vector<float> two_voxels() {
  std::vector<float> numbers = test::upper_triangle(test::symmetric_tensor());
  for (const float number : test::upper_triangle(0.5 * test::symmetric_tensor())) numbers.push_back(number);
  return numbers;
}

std::string deflated(const std::string& bytes) {
  std::string result(compressBound(bytes.size()), '\0');
  uLongf size = result.size();
  compress(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  return result.substr(0, size);
}

const Matrix3d flip = Vector3d(-1, -1, 1).asDiagonal();  // From LPS to RAS.

void expect_two_voxels(const Lattice& lattice) {
  const TensorGrid grid = test::tensors_of(lattice);
  const Matrix3d expected = flip * test::symmetric_tensor() * flip;
  test::expect_near(expected, find(grid, {0, 0, 0}));
  test::expect_near(0.5 * expected, find(grid, {1, 0, 0}));
}

TEST(MetaImage, ComponentsAndWorldAreOfLps) {
  const Matrix3d turn = test::rotation();  // Its columns are the directions of the axes, one after the other.
  std::string matrix;
  for (int i = 0; i < 9; ++i) matrix += fmt::format(" {}", turn(i % 3, i / 3));
  const Temporary file(
      "a.mha", header_of(6, {2, 1, 1}, "TransformMatrix =" + matrix + "\nOffset = 10 20 30\nElementSpacing = 2 3 4\n") +
                   test::bytes_of(two_voxels()));
  const Lattice lattice = open_metaimage(file);
  expect_two_voxels(lattice);
  EXPECT_LT((lattice.to_world * Vector3d::Zero() - Vector3d(-10, -20, 30)).norm(), 1e-9);
  EXPECT_LT((lattice.to_world.linear() - flip * turn * Vector3d(2, 3, 4).asDiagonal()).norm(), 1e-5);
}

TEST(MetaImage, EveryPlaceOfTheNumbers) {
  const std::string bytes = test::bytes_of(two_voxels());
  std::string swapped = bytes, doubles;
  for (auto number = swapped.begin(); number != swapped.end(); number += 4) std::reverse(number, number + 4);
  for (const float number : two_voxels()) append_number(static_cast<double>(number), ByteOrder::little, doubles);
  const auto expect_sound = [&](const std::string& contents, const std::string& data = "") {
    const Temporary raw("a.raw", data), file("a.mhd", contents);
    expect_two_voxels(open_metaimage(file));
  };
  const std::string raw_name = Temporary("a.raw").filename();
  expect_sound(header_of(6, {2, 1, 1}) + bytes);
  expect_sound(header_of(6, {2, 1, 1}, "BinaryDataByteOrderMSB = True\n") + swapped);
  expect_sound(header_of(6, {2, 1, 1}, "CompressedData = True\nCompressedDataSize = 7\n") + deflated(bytes));
  expect_sound(header_of(6, {2, 1, 1}, "", "MET_DOUBLE") + doubles);
  expect_sound(header_of(6, {2, 1, 1}, "", "MET_FLOAT", raw_name), bytes);
  expect_sound(header_of(6, {2, 1, 1}, "HeaderSize = 5\n", "MET_FLOAT", raw_name), "12345" + bytes);
  expect_sound(header_of(6, {2, 1, 1}, "HeaderSize = -1\n", "MET_FLOAT", raw_name), "1234567" + bytes);
  expect_sound(header_of(6, {2, 1, 1}, "CompressedData = True\n", "MET_FLOAT", raw_name), deflated(bytes));
}

TEST(MetaImage, DamageAndOtherKindsAreErrorsWithTheFile) {
  const std::string bytes = test::bytes_of(two_voxels());
  const auto expect = [](const std::string& contents, const std::string& word) {
    test::refuses(open_metaimage, "bad.mha", contents, {word});
  };
  expect("", "MetaImage");
  expect("NDims = 3\n", "ElementDataFile");
  expect(header_of(6, {2, 1, 1}) + bytes.substr(1), "cut off");
  expect(header_of(6, {2, 1, 1}, "CompressedData = True\n") + deflated(bytes).substr(0, 9), "cut off");
  expect(header_of(6, {2, 1, 1}, "CompressedData = True\n") + bytes, "damaged");
  expect(header_of(6, {20000, 20000, 20000}) + bytes, "announces");
  expect(header_of(6, {0, 1, 1}) + bytes, "DimSize");
  expect(header_of(5, {2, 1, 1}) + bytes, "5 channels");
  expect(header_of(6, {2, 1, 1}, "NDims = 2\n") + bytes, "NDims");
  expect(replaced_text(header_of(6, {2, 1, 1}), "BinaryData = True", "BinaryData = False") + bytes, "text");
  expect(header_of(6, {2, 1, 1}, "TransformMatrix = 1 0 0 1 0 0 0 0 1\n") + bytes, "inverted");
  expect(header_of(6, {2, 1, 1}, "ElementSpacing = 1 x 1\n") + bytes, "ElementSpacing");
  expect(header_of(6, {2, 1, 1}, "", "MET_OTHER") + bytes, "MET_OTHER");
  expect(header_of(6, {2, 1, 1}, "", "MET_FLOAT", "none.raw"), "none.raw");
  expect(header_of(6, {2, 1, 1}, "", "MET_FLOAT", "LIST") + bytes, "several files");
  std::string header = header_of(6, {1, 1, 1}, "", "MET_UCHAR");
  header.pop_back();  // The last line does not end.
  expect(header, "announces 6 bytes");
}

}  // namespace
}  // namespace tensorray
