#pragma once
/// An OpenFOAM case as blockMesh and a solver would write it, in ASCII: 2 x 2 x 2 hexahedra of 1 x 0.5 x 2.

#include <array>

#include "tests/import/mesh_files.h"

namespace tensorray {

class OpenFoamCase {
 public:
  static constexpr int cells = 8;

  /// A component of a cell's value in OpenFOAM's order. `at_end` is the time, 0 or 1.
  static double value(int cell, int component, int at_end) { return 1000 * at_end + 10 * cell + component; }

  /// @param part  The case is moved by so many of its widths along x, and its cells have the numbers of the next ones.
  static void write(const std::filesystem::path& folder, int part = 0) {
    OpenFoamCase mesh;
    mesh.part_ = part;
    mesh.make();
    write_mesh(folder, mesh.rows());
    write_times(folder, "0.5");
    for (const int at_end : {0, 1}) {
      const std::filesystem::path time = folder / (at_end ? "0.5" : "0");
      mesh.write_field(time / "U", "volVectorField", "vector", 3, at_end);
      mesh.write_field(time / "sigma", "volSymmTensorField", "symmTensor", 6, at_end);
      mesh.write_field(time / "gradU", "volTensorField", "tensor", 9, at_end);
    }
  }

  static std::string head(const std::string& kind, const std::string& object) {
    return "FoamFile\n{\n    version 2.0;\n    format ascii;\n    class " + kind + ";\n    object " + object + ";\n}\n";
  }

  static std::string list(const std::vector<std::string>& rows) {
    std::string text = std::to_string(rows.size()) + "\n(\n";
    for (const std::string& row : rows) text += row + "\n";
    return text + ")\n";
  }

  /// The last of the times 0 and `end`, and all that a case needs besides its mesh and fields.
  static void write_times(const std::filesystem::path& folder, const std::string& end) {
    write_bytes(folder / "system" / "controlDict", head("dictionary", "controlDict") +
                                                       "application none;\nstartFrom startTime;\nstartTime 0;\nstopAt "
                                                       "endTime;\nendTime " +
                                                       end + ";\ndeltaT " + end +
                                                       ";\nwriteControl timeStep;\nwriteInterval 1;\n");
  }

  /// What a mesh is made of, as rows of OpenFOAM's lists.
  struct Mesh {
    std::vector<std::string> points, faces, owner, neighbour, boundary;
  };

  static void write_mesh(const std::filesystem::path& folder, const Mesh& mesh) {
    const std::filesystem::path path = folder / "constant" / "polyMesh";
    write_bytes(path / "points", head("vectorField", "points") + list(mesh.points));
    write_bytes(path / "faces", head("faceList", "faces") + list(mesh.faces));
    write_bytes(path / "owner", head("labelList", "owner") + list(mesh.owner));
    write_bytes(path / "neighbour", head("labelList", "neighbour") + list(mesh.neighbour));
    write_bytes(path / "boundary", head("polyBoundaryMesh", "boundary") + list(mesh.boundary));
  }

 private:
  using Face = std::array<int, 4>;
  struct Side {
    int owner, neighbour;
    Face face;
  };

  static int point(int i, int j, int k) { return i + 3 * (j + 3 * k); }

  void write_field(const std::filesystem::path& path, const std::string& kind, const std::string& type, int components,
                   int at_end) const {
    std::vector<std::string> rows;
    for (int cell = 0; cell < cells; ++cell) {
      std::string row = "(";
      for (int c = 0; c < components; ++c) row += std::to_string(value(cells * part_ + cell, c, at_end)) + " ";
      rows.push_back(row + ")");
    }
    write_bytes(path, head(kind, path.filename().string()) +
                          "dimensions [0 0 0 0 0 0 0];\ninternalField nonuniform List<" + type + ">\n" + list(rows) +
                          ";\nboundaryField\n{\n    walls\n    {\n        type zeroGradient;\n    }\n}\n");
  }

  /// Makes the faces in OpenFOAM's order: inner faces by owner and then neighbour, then boundary faces.
  void make() {
    for (int cell = 0; cell < cells; ++cell) {
      const int i = cell % 2, j = cell / 2 % 2, k = cell / 4;
      const auto p = [&](int a, int b, int c) { return point(i + a, j + b, k + c); };
      add(i == 0, cell, cell + 1, {p(1, 0, 0), p(1, 1, 0), p(1, 1, 1), p(1, 0, 1)});
      add(j == 0, cell, cell + 2, {p(0, 1, 0), p(0, 1, 1), p(1, 1, 1), p(1, 1, 0)});
      add(k == 0, cell, cell + 4, {p(0, 0, 1), p(1, 0, 1), p(1, 1, 1), p(0, 1, 1)});
      if (i == 0) add(false, cell, 0, {p(0, 0, 0), p(0, 0, 1), p(0, 1, 1), p(0, 1, 0)});
      if (j == 0) add(false, cell, 0, {p(0, 0, 0), p(1, 0, 0), p(1, 0, 1), p(0, 0, 1)});
      if (k == 0) add(false, cell, 0, {p(0, 0, 0), p(0, 1, 0), p(1, 1, 0), p(1, 0, 0)});
    }
  }

  void add(bool inner, int owner, int neighbour, const Face& face) {
    (inner ? inner_ : outer_).push_back({owner, neighbour, face});
  }

  Mesh rows() const {
    Mesh mesh;
    for (int n = 0; n < 27; ++n)
      mesh.points.push_back("(" + std::to_string(2 * part_ + n % 3) + " " + std::to_string(0.5 * (n / 3 % 3)) + " " +
                            std::to_string(2 * (n / 9)) + ")");
    for (const auto* sides : {&inner_, &outer_})
      for (const Side& side : *sides) {
        std::string face = "4(";
        for (const int p : side.face) face += std::to_string(p) + " ";
        mesh.faces.push_back(face + ")");
        mesh.owner.push_back(std::to_string(side.owner));
        if (sides == &inner_) mesh.neighbour.push_back(std::to_string(side.neighbour));
      }
    mesh.boundary = {"walls\n{\n    type wall;\n    nFaces " + std::to_string(outer_.size()) + ";\n    startFace " +
                     std::to_string(inner_.size()) + ";\n}"};
    return mesh;
  }

  int part_ = 0;
  std::vector<Side> inner_, outer_;
};

}  // namespace tensorray
