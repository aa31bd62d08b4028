#pragma once
/// The numbers a fit runs on: one place, the same for all data. docs/benchmarks.md says how they
/// were chosen and what lost.

#include "fit/adam.h"

namespace esvr {

struct Tuning {
  StepSizes steps;
  AdamOptions adam;
  double smallestScale = 0.2;   ///< voxels: supports then span one, so that no gaps show between
  double largestScale = 16.0;   ///< voxels; larger ones cost time and gain nothing
  double finalStep = 0.2;       ///< step sizes shrink to this fraction over the run
  double tail = 0.15;           ///< last fraction of the run, over which steps go to zero
  double firstShare = 0.2;      ///< of the count, seeded at the start
  double growUntil = 0.3;       ///< fraction of the run by which the rest has been added
  double relocateUntil = 0.7;   ///< fraction of the run
  double relocateShare = 0.05;  ///< of the ellipsoids, moved by each event
  double eventEvery = 0.01;     ///< of the run
  int eventSpacing = 15;        ///< iterations between events at least: new ellipsoids must settle
  int graceSteps = 14;          ///< an ellipsoid younger than this is not relocated
  float firstKappa = 0.5f;      ///< where its descent begins
  double kappaStep = 0.1;       ///< largest change of kappa by an event
  double seedIntensity = 1.0;   ///< of the residual at a seed
  double seedWindow = 0.35;     ///< half width over the spacing of seeds
  double intensityHeadroom = 1.5;  ///< intensities stay within so many times the target's range
  double listSlack = 0.5;          ///< voxels by which supports are widened in the pair lists
  int rebuildEvery = 10;           ///< iterations a pair list serves
  int warmUp = 20;                 ///< iterations over which step sizes rise to their full length
};

}  // namespace esvr
