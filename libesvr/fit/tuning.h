#pragma once
/// The tuned constants of a fit, which are the same for all data. docs/lab-notes.md, "The fit", has
/// what was tried instead.

#include "fit/adam.h"
#include "fit/listed_support.h"

namespace esvr {

struct Tuning {
  StepSizes steps;
  AdamOptions adam;
  double smallestScale = 0.2;   ///< voxels; a support then spans a voxel, and no gaps show
  double largestScale = 16.0;   ///< voxels; larger scales take time and do not reduce the error
  double finalStep = 0.2;       ///< factor of the step sizes at the end of the decay
  double tail = 0.15;           ///< last fraction of the run, in which step sizes go to zero
  double firstShare = 0.1;      ///< share of the ellipsoids that are seeded at the start
  double growUntil = 0.5;       ///< fraction of the run at which growth ends
  double relocateUntil = 0.7;   ///< fraction of the run at which relocation ends
  double relocateShare = 0.05;  ///< share of the ellipsoids that an event relocates
  double eventEvery = 0.01;     ///< fraction of the run between events
  int eventSpacing = 15;        ///< smallest number of iterations between events
  int graceSteps = 14;          ///< steps of a new ellipsoid before it can be relocated
  float firstKappa = 0.5f;      ///< initial kappa if it is fitted
  double kappaStep = 0.1;       ///< largest change of kappa by an event
  double seedIntensity = 1.0;   ///< intensity of a seed, relative to the residual
  double seedWindow = 0.35;     ///< half width of a seed's window, relative to the seeds' spacing
  double intensityHeadroom = 1.5;  ///< limit of intensities, relative to the target's range
  SlackRule slack;                 ///< decides when pair lists are rebuilt
  int warmUp = 20;                 ///< iterations in which step sizes rise to their full size
};

}  // namespace esvr
