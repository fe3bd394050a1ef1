#pragma once
/// @file renderer/sampling/distribution.h
/// Choice among cells in proportion to given values, on a line and in a picture. Immutable: any thread may sample.

#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Cells 0 to size − 1. Seen as a piecewise constant density on [0, 1), that of cell i is probability(i) * size.
class Distribution1D {
 public:
  /// @param values  Of the cells; finite, >= 0. If all are 0, every cell has the same probability.
  /// @throw std::invalid_argument if there are none, or one is negative or not finite.
  explicit Distribution1D(const std::vector<double>& values);

  struct Sample {
    int cell = 0;
    double within = 0;  ///< Evenly spread over [0, 1): the place in the cell, or a number for the next choice.
    double probability = 0;
  };

  /// The cell that `u` of [0, 1) falls in, by inversion: monotonic, never a cell of probability 0.
  Sample sample(double u) const;
  double probability(int cell) const { return cumulative_[cell + 1] - cumulative_[cell]; }

  int size() const { return static_cast<int>(cumulative_.size()) - 1; }
  double sum() const { return sum_; }  ///< Of the values.

 private:
  std::vector<double> cumulative_;  ///< From 0 to 1.
  double sum_ = 0;
};

/// Cells (x, y) of a picture: first the row by its sum, then the cell in it.
class Distribution2D {
 public:
  /// @param values  width * height of them, row by row; as for Distribution1D.
  /// @throw std::invalid_argument if there are not as many, or one is negative or not finite.
  Distribution2D(const std::vector<double>& values, int width, int height);

  struct Sample {
    Eigen::Vector2i cell = Eigen::Vector2i::Zero();
    Eigen::Vector2d within = Eigen::Vector2d::Zero();
    double probability = 0;
  };

  Sample sample(const Eigen::Vector2d& u) const;
  double probability(const Eigen::Vector2i& cell) const;

  double sum() const { return column_.sum(); }

 private:
  std::vector<Distribution1D> rows_;
  Distribution1D column_;
};

}  // namespace tensorray
