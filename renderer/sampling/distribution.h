#pragma once
/// @file renderer/sampling/distribution.h
/// Random choice of cells, in one or two dimensions, with given relative probabilities. Immutable: any thread may
/// sample.

#include <vector>

#include <Eigen/Core>

namespace tensorray {

/// Chooses among the cells 0 to size − 1. As a piecewise constant density on [0, 1), cell i has probability(i) * size.
class Distribution1D {
 public:
  /// @param values  Relative probabilities of the cells; finite, >= 0. If all are 0, all cells are equally probable.
  /// @throw std::invalid_argument if there are no values, or one is negative or not finite.
  explicit Distribution1D(const std::vector<double>& values);

  struct Sample {
    int cell = 0;
    double within = 0;  ///< Uniform in [0, 1): the position in the cell, or a number for the next choice.
    double probability = 0;
  };

  /// The cell that contains `u` (in [0, 1)), by inversion: monotonic, and never a cell of probability 0.
  Sample sample(double u) const;
  double probability(int cell) const { return cumulative_[cell + 1] - cumulative_[cell]; }
  double sum() const { return sum_; }  ///< Sum of the values.

 private:
  std::vector<double> cumulative_;  ///< Cumulative probabilities, from 0 to 1.
  double sum_ = 0;
};

/// Chooses among the cells (x, y) of a picture: first a row by the sum of its values, then a cell in it.
class Distribution2D {
 public:
  /// @param values  width * height relative probabilities, row by row, as for Distribution1D.
  /// @throw std::invalid_argument if their number is not width * height, or one is negative or not finite.
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
