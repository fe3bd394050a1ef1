#pragma once
/// OpenFOAM cases as blockMesh and a solver would write them, in ASCII.

#include <map>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "tests/import/mesh_files.h"

namespace tensorray {

class OpenFoamCase {
 public:
  static constexpr int cells = 8;

  /// A component of a cell's value in OpenFOAM's order. `at_end` is the time, 0 or 1.
  static double value(int cell, int component, int at_end) { return 1000 * at_end + 10 * cell + component; }

  /// 2 x 2 x 2 hexahedra of 1 x 0.5 x 2.
  /// @param part  The case is moved by so many of its widths along x, and its cells have the numbers of the next ones.
  static void write(const std::filesystem::path& folder, int part = 0) {
    std::vector<std::string> points;
    for (int i = 0; i < 27; ++i)
      points.push_back(fmt::format("({} {} {})", 2 * part + i % 3, 0.5 * (i / 3 % 3), 2 * (i / 9)));
    const std::vector<std::vector<int>> faces_of_first{{0, 9, 12, 3},  {1, 4, 13, 10}, {0, 1, 10, 9},
                                                       {3, 12, 13, 4}, {0, 3, 4, 1},   {9, 10, 13, 12}};
    std::vector<Face> faces;
    for (int cell = 0; cell < cells; ++cell)
      for (std::vector<int> face : faces_of_first) {
        for (int& point : face) point += cell % 2 + 3 * (cell / 2 % 2) + 9 * (cell / 4);
        faces.push_back({face, "walls", cell});
      }
    write_mesh(folder, points, faces);
    write_times(folder, "0.5");
    for (const int at_end : {0, 1}) {
      const std::filesystem::path time = folder / (at_end ? "0.5" : "0");
      write_field(time / "U", "volVectorField", "vector", 3, part, at_end);
      write_field(time / "sigma", "volSymmTensorField", "symmTensor", 6, part, at_end);
      write_field(time / "gradU", "volTensorField", "tensor", 9, part, at_end);
    }
  }

  static std::string head(const std::string& kind, const std::string& object) {
    return "FoamFile\n{\n    version 2.0;\n    format ascii;\n    class " + kind + ";\n    object " + object + ";\n}\n";
  }

  static std::string list(const std::vector<std::string>& rows) {
    return fmt::format("{}\n(\n{}\n)\n", rows.size(), fmt::join(rows, "\n"));
  }

  /// The last of the times 0 and `end`, and all that a case needs besides its mesh and fields.
  static void write_times(const std::filesystem::path& folder, const std::string& end) {
    write_bytes(folder / "system" / "controlDict",
                head("dictionary", "controlDict") +
                    fmt::format("application none;\nstartFrom startTime;\nstartTime 0;\nstopAt endTime;\nendTime {0};\n"
                                "deltaT {0};\nwriteControl timeStep;\nwriteInterval 1;\n",
                                end));
  }

  /// A face of a cell.
  struct Face {
    std::vector<int> points;  ///< In the order that turns about the normal out of the cell.
    std::string patch;        ///< If no other cell has it. "procBoundary..." is a processor's, "walls" is a wall.
    int owner = 0;            ///< The cell.
    int neighbour = -1;       ///< Another cell that has it; write_mesh finds it.
  };

  /// @param points  Rows of OpenFOAM's list. @param faces_of_cells  Cell by cell; those of two cells become one.
  /// @return how many faces each patch has.
  static std::map<std::string, std::size_t> write_mesh(const std::filesystem::path& folder,
                                                       const std::vector<std::string>& points,
                                                       const std::vector<Face>& faces_of_cells) {
    std::map<std::vector<int>, Face> sides;  // By their points in ascending order.
    for (const Face& face : faces_of_cells) {
      std::vector<int> key = face.points;
      std::sort(key.begin(), key.end());
      const auto [side, is_new] = sides.try_emplace(key, face);
      if (is_new) continue;
      side->second.neighbour = face.owner;
      side->second.patch.clear();
    }
    // Inner faces, which have no patch, are first.
    std::vector<Face> ordered;
    for (const auto& [key, face] : sides) ordered.push_back(face);
    std::sort(ordered.begin(), ordered.end(), [](const Face& a, const Face& b) {
      return std::tie(a.patch, a.owner, a.neighbour) < std::tie(b.patch, b.owner, b.neighbour);
    });
    std::vector<std::string> faces, owners, neighbours, boundary;
    std::map<std::string, std::size_t> patches;
    for (const Face& face : ordered) {
      faces.push_back(fmt::format("{}({})", face.points.size(), fmt::join(face.points, " ")));
      owners.push_back(std::to_string(face.owner));
      if (face.patch.empty()) neighbours.push_back(std::to_string(face.neighbour));
      if (!face.patch.empty()) ++patches[face.patch];
    }
    std::size_t start = neighbours.size();
    for (const auto& [patch, count] : patches) {
      const char* const type = patch.rfind("procBoundary", 0) == 0 ? "processor" : patch == "walls" ? "wall" : "patch";
      boundary.push_back(
          fmt::format("{}\n{{\n    type {};\n    nFaces {};\n    startFace {};\n}}", patch, type, count, start));
      start += count;
    }
    const std::filesystem::path path = folder / "constant" / "polyMesh";
    write_bytes(path / "points", head("vectorField", "points") + list(points));
    write_bytes(path / "faces", head("faceList", "faces") + list(faces));
    write_bytes(path / "owner", head("labelList", "owner") + list(owners));
    write_bytes(path / "neighbour", head("labelList", "neighbour") + list(neighbours));
    write_bytes(path / "boundary", head("polyBoundaryMesh", "boundary") + list(boundary));
    return patches;
  }

 private:
  static void write_field(const std::filesystem::path& path, const std::string& kind, const std::string& type,
                          int components, int part, int at_end) {
    std::vector<std::string> rows;
    for (int cell = 0; cell < cells; ++cell) {
      std::vector<double> row;
      for (int c = 0; c < components; ++c) row.push_back(value(cells * part + cell, c, at_end));
      rows.push_back(fmt::format("({:f})", fmt::join(row, " ")));
    }
    write_bytes(path, head(kind, path.filename().string()) +
                          "dimensions [0 0 0 0 0 0 0];\ninternalField nonuniform List<" + type + ">\n" + list(rows) +
                          ";\nboundaryField\n{\n    walls\n    {\n        type zeroGradient;\n    }\n}\n");
  }
};

}  // namespace tensorray
