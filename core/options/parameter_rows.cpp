#include <algorithm>
#include <thread>

#include "core/options/parameter_places.h"

namespace crease {
namespace {

using places::all;
using places::at;
using places::axis_at;
using places::degrees_at;

using Mrf = MrfOptions;
using Median = FuzzyVectorMedianOptions;
using Taubin = TaubinOptions;
using Flow = MeanCurvatureFlowOptions;
using AnisotropicFlow = AnisotropicFlowOptions;
using Diffusion = NormalDiffusionOptions;
using NonIterative = NonIterativeOptions;
using Bilateral = BilateralOptions;
using Diebel = DiebelOptions;

constexpr std::string_view kJob = "Job", kAutomatic = "Automatic setting", kAnnealing = "Annealing",
                           kLikelihood = "Likelihood", kSmoothness = "Smoothness", kRidges = "Ridges",
                           kFaces = "Face process", kClassical = "Classical methods";
constexpr std::string_view kEdgeLengths = "edge lengths", kPerSquare = "1/edge length²", kDegrees = "degrees";
constexpr double kLargestSeed = 4294967295.0;

const ParameterCondition kVertexProcess{"process", {"vertex", "both"}};
const ParameterCondition kFaceProcess{"process", {"face", "both"}};
const ParameterCondition kDescent{"solver", {"descent"}};
const ParameterCondition kMetropolis{"solver", {"metropolis"}};
const ParameterCondition kLabels{"edge_process", {"true"}};
const ParameterCondition kHuber{"likelihood", {"huber"}};
const ParameterCondition kAnisotropic{"likelihood", {"anisotropic"}};

ParameterValue processors(const ParameterValues& /*given*/) {
  return std::max(1U, std::thread::hardware_concurrency());
}

std::vector<ParameterPlace> method_place() {
  const auto& names = method_names();
  return {{.method = std::nullopt,
           .type = ParameterType::kWord,
           .words = {names.begin(), names.end()},
           .get = [](const JobOptions& job) -> ParameterValue {
             return std::string(method_names().at(job.smooth.method.index()));
           },
           .set =
               [](JobOptions& job, const ParameterValue& value) {
                 const auto& words = method_names();
                 const auto word = std::ranges::find(words, std::get<std::string>(value));
                 job.smooth.method = default_method(static_cast<std::size_t>(word - words.begin()));
               }}};
}

/// Whether a parameter matters only with the sampler, itself or through what it depends on.
bool is_of_sampler(const Parameter& parameter) {
  return std::ranges::any_of(parameter.conditions, [](const ParameterCondition& condition) {
    return condition.parameter == kMetropolis.parameter ? condition.words == kMetropolis.words
                                                        : is_of_sampler(find_parameter(condition.parameter));
  });
}

/// The sampler where one of its parameters was given, so that no value is given in vain.
ParameterValue solver_for(const ParameterValues& given) {
  const bool sampler = std::ranges::any_of(given, [](const auto& one) {
    const Parameter& parameter = find_parameter(one.first);
    const bool left_open = !parameter.automatic.text.empty() && text_of(one.second) == parameter.automatic.text;
    return !left_open && is_of_sampler(parameter);
  });
  return std::string(words_of(Solver{}).at(static_cast<std::size_t>(sampler ? Solver::kMetropolis : Solver::kDescent)));
}

std::vector<Parameter> make_table() {
  return {
      {.name = "method",
       .field = 1,
       .group = kJob,
       .meaning = "Denoising method: mrf, the Markov random field, or one that the paper compares with: "
                  "fuzzy_vector_median [Shen & Barner 2004], taubin [1995], mean_curvature_flow [Desbrun et al. 1999], "
                  "anisotropic_flow [Desbrun et al. 2000], normal_diffusion [Tasdizen et al. 2002], non_iterative "
                  "[Jones et al. 2003], bilateral [Fleishman et al. 2003], diebel [Diebel et al. 2006]. Those leave "
                  "every label 0.",
       .places = method_place()},
      {.name = "process",
       .field = 2,
       .group = kAnnealing,
       .meaning = "Which field is sampled beside the ridge labels: vertex positions; face normals in rounds, with the "
                  "vertices fitted to them; or both, one after the other. auto takes both.",
       .places = at<&Mrf::process>(),
       .conditions = {kMetropolis},
       .automatic = {"auto"}},
      {.name = "solver",
       .field = 3,
       .group = kAnnealing,
       .meaning =
           "descent, the automatic setting: labels minimised out, noise, potential and weight estimated from the "
           "upload; metropolis, the paper's model and sampler. auto takes descent, or metropolis where a "
           "parameter is given that only the sampler has.",
       .places = at<&Mrf::solver>(),
       .automatic = {"auto", solver_for}},
      {.name = "sweeps",
       .field = 4,
       .group = kAnnealing,
       .unit = "sweeps",
       .meaning =
           "Iterations: each visits every edge, then every vertex or face. Half as many of each where process is both.",
       .places = at<&Mrf::sweeps>(1, 100000),
       .conditions = {kMetropolis}},
      {.name = "seed",
       .field = 5,
       .group = kAnnealing,
       .meaning = "Key of the random numbers. The same upload, parameters and seed give the same bytes.",
       .places = at<&Mrf::seed>(0, kLargestSeed)},
      {.name = "threads",
       .field = 6,
       .group = kJob,
       .unit = "threads",
       .meaning = "Threads of the job; 0 takes as many as the machine has processors. Never changes the result.",
       .places = at<&SmoothOptions::threads>(0, 256),
       .automatic = {"0", processors},
       .changes_result = false},
      {.name = "likelihood",
       .field = 7,
       .group = kLikelihood,
       .meaning = "How displacement from the measured position is penalised: quadratic, for isotropic Gaussian noise; "
                  "huber, for outliers; anisotropic, for noise along a scanner's direction or the vertex normal; "
                  "volume, which keeps neighbourhoods from sweeping volume.",
       .places = at<&Mrf::likelihood>(),
       .conditions = {kVertexProcess}},
      {.name = "likelihood_weight",
       .field = 8,
       .group = kLikelihood,
       .unit = kPerSquare,
       .meaning = "Weight α of the likelihood after annealing: how far measured positions are believed.",
       .places = at<&Mrf::likelihood_weight>(0, 1000),
       .conditions = {kVertexProcess}},
      {.name = "likelihood_weight_start",
       .field = 9,
       .group = kLikelihood,
       .unit = kPerSquare,
       .meaning = "Weight α at the start, going geometrically to likelihood_weight, so that ridges are labelled before "
                  "they can be smoothed away.",
       .places = at<&Mrf::likelihood_weight_start>(0, 1000),
       .conditions = {kVertexProcess}},
      {.name = "likelihood_width",
       .field = 10,
       .group = kLikelihood,
       .unit = kEdgeLengths,
       .meaning = "Displacement beyond which the penalty grows linearly.",
       .places = at<&Mrf::likelihood_width>(1e-6, 1000),
       .conditions = {kHuber}},
      {.name = "scan_direction_x",
       .field = 11,
       .group = kLikelihood,
       .meaning = "x of the direction that the noise lies along, of any length; all three 0 is the vertex normal.",
       .places = axis_at<&Mrf::scan_direction, 0>(-1e6, 1e6),
       .conditions = {kAnisotropic}},
      {.name = "scan_direction_y",
       .field = 12,
       .group = kLikelihood,
       .meaning = "y of the direction that the noise lies along.",
       .places = axis_at<&Mrf::scan_direction, 1>(-1e6, 1e6),
       .conditions = {kAnisotropic}},
      {.name = "scan_direction_z",
       .field = 13,
       .group = kLikelihood,
       .meaning = "z of the direction that the noise lies along.",
       .places = axis_at<&Mrf::scan_direction, 2>(-1e6, 1e6),
       .conditions = {kAnisotropic}},
      {.name = "likelihood_across",
       .field = 14,
       .group = kLikelihood,
       .meaning = "Cost of displacement across the direction, relative to along it.",
       .places = at<&Mrf::likelihood_across>(0, 1e6),
       .conditions = {kAnisotropic}},
      {.name = "volume_weight",
       .field = 15,
       .group = kLikelihood,
       .meaning = "Weight of the squared mean displacement of a vertex and its neighbours along their normals.",
       .places = at<&Mrf::volume_weight>(0, 1e6),
       .conditions = {{"likelihood", {"volume"}}}},
      {.name = "smoothness",
       .field = 16,
       .group = kSmoothness,
       .meaning = "Potential ρ of the difference x of adjacent face normals: quadratic ‖x‖²; square_root ‖x‖; huber, "
                  "quadratic up to a width and linear beyond; truncated, constant beyond.",
       .places = at<&Mrf::smoothness>(),
       .conditions = {kMetropolis}},
      {.name = "smoothness_weight",
       .field = 17,
       .group = kSmoothness,
       .meaning = "Weight β of the smoothness prior.",
       .places = at<&Mrf::smoothness_weight>(0, 1000),
       .conditions = {kMetropolis}},
      {.name = "smoothness_width_deg",
       .field = 18,
       .group = kSmoothness,
       .unit = kDegrees,
       .meaning = "Dihedral angle at which the potential leaves the quadratic one.",
       .places = degrees_at<&Mrf::smoothness_width>(0.001, 180),
       .conditions = {{"smoothness", {"huber", "truncated"}}}},
      {.name = "curvature_weight",
       .field = 19,
       .group = kSmoothness,
       .meaning = "Weight of the piecewise-quadratic prior of the vertex process: normals change linearly from face to "
                  "face, as they do on cylinders, cones and paraboloids.",
       .places = at<&Mrf::curvature_weight>(0, 1000),
       .conditions = {kMetropolis}},
      {.name = "edge_process",
       .field = 20,
       .group = kRidges,
       .meaning = "Label ridges and do not smooth across them. Without it every label is 0.",
       .places = at<&Mrf::edge_process>(),
       .conditions = {kMetropolis}},
      {.name = "sharpness_threshold_deg",
       .field = 21,
       .group = kRidges,
       .unit = kDegrees,
       .meaning = "Dihedral angle φ₀ above which an edge is probably a ridge, by its sharpness alone.",
       .places = degrees_at<&Mrf::sharpness_threshold>(0, 180),
       .conditions = {kLabels}},
      {.name = "sharpness_weight",
       .field = 22,
       .group = kRidges,
       .unit = "1/radian",
       .meaning = "Weight γ of the edge sharpness.",
       .places = at<&Mrf::sharpness_weight>(0, 1000),
       .conditions = {kLabels}},
      {.name = "support_weight",
       .field = 23,
       .group = kRidges,
       .unit = "radians",
       .meaning = "Weight κ of the support of collinear ridge edges, relative to the sharpness.",
       .places = at<&Mrf::support_weight>(0, 1000),
       .conditions = {kLabels}},
      {.name = "ridge_kind",
       .field = 24,
       .group = kRidges,
       .meaning = "Curvature clamping: which edges may be ridges; the others are smoothed away.",
       .places = at<&Mrf::ridge_kind>(),
       .conditions = {kLabels}},
      {.name = "sharpness_limit_deg",
       .field = 25,
       .group = kRidges,
       .unit = kDegrees,
       .meaning = "Curvature clamping: edges with a larger dihedral angle are no ridges and are smoothed away.",
       .places = degrees_at<&Mrf::sharpness_limit>(0, 180),
       .conditions = {kLabels}},
      {.name = "continuity_weight",
       .field = 26,
       .group = kRidges,
       .unit = "1/radian²",
       .meaning = "Edge process: weight of the squared change of the dihedral angle along a ridge line.",
       .places = at<&Mrf::continuity_weight>(0, 1000),
       .conditions = {kLabels}},
      {.name = "ridge_line_weight",
       .field = 27,
       .group = kRidges,
       .unit = kPerSquare,
       .meaning = "Weight of the squared second difference of positions along a ridge line, in the vertex process.",
       .places = at<&Mrf::ridge_line_weight>(0, 1000),
       .conditions = {kLabels}},
      {.name = "rounds",
       .field = 28,
       .group = kFaces,
       .unit = "rounds",
       .meaning = "Rounds that the sweeps of the face process are divided into, each annealing the normals and fitting "
                  "the vertices to them; the next takes the fitted normals as the measured ones.",
       .places = at<&Mrf::rounds>(1, 100),
       .conditions = {kFaceProcess}},
      {.name = "fit_steps",
       .field = 29,
       .group = kFaces,
       .unit = "steps",
       .meaning = "Steps of the least-squares fit of the vertices at the end of a round.",
       .places = at<&Mrf::fit_steps>(1, 10000),
       .conditions = {kFaceProcess}},
      {.name = "normal_weight",
       .field = 30,
       .group = kFaces,
       .meaning = "Weight of the squared difference of a normal from the measured one.",
       .places = at<&Mrf::normal_weight>(0, 1000),
       .conditions = {kFaceProcess}},
      {.name = "corner_weight",
       .field = 31,
       .group = kFaces,
       .meaning = "Weight of the smoothness between faces that share only a vertex; 1 for those at an edge.",
       .places = at<&Mrf::corner_weight>(0, 1000),
       .conditions = {kFaceProcess}},
      {.name = "normal_temperature_start",
       .field = 32,
       .group = kFaces,
       .meaning = "Temperature of the normals at the start of a round.",
       .places = at<&Mrf::normal_temperature_start>(1e-9, 1000),
       .conditions = {kFaceProcess, kMetropolis}},
      {.name = "normal_temperature_end",
       .field = 33,
       .group = kFaces,
       .meaning = "Temperature of the normals at the end of a round.",
       .places = at<&Mrf::normal_temperature_end>(1e-9, 1000),
       .conditions = {kFaceProcess, kMetropolis}},
      {.name = "label_temperature_start",
       .field = 34,
       .group = kAnnealing,
       .meaning = "Temperature of the edge process at the start.",
       .places = at<&Mrf::label_temperature_start>(1e-9, 1000),
       .conditions = {kLabels}},
      {.name = "label_temperature_end",
       .field = 35,
       .group = kAnnealing,
       .meaning = "Temperature of the edge process at the end; too low, and noise freezes into labels.",
       .places = at<&Mrf::label_temperature_end>(1e-9, 1000),
       .conditions = {kLabels}},
      {.name = "vertex_temperature_start",
       .field = 36,
       .group = kAnnealing,
       .meaning = "Temperature of the vertex process at the start.",
       .places = at<&Mrf::vertex_temperature_start>(1e-9, 1000),
       .conditions = {kVertexProcess, kMetropolis}},
      {.name = "vertex_temperature_end",
       .field = 37,
       .group = kAnnealing,
       .meaning = "Temperature of the vertex process at the end.",
       .places = at<&Mrf::vertex_temperature_end>(1e-9, 1000),
       .conditions = {kVertexProcess, kMetropolis}},
      {.name = "step_size",
       .field = 38,
       .group = kAnnealing,
       .unit = kEdgeLengths,
       .meaning = "Half-width of a proposed displacement at the start, or of the turn of a normal in radians; it then "
                  "follows the acceptance rate.",
       .places = at<&Mrf::step_size>(1e-6, 10),
       .conditions = {kMetropolis}},
      {.name = "iterations",
       .field = 39,
       .group = kClassical,
       .unit = "iterations",
       .meaning = "Passes of the filter, steps of the flow, or steps of conjugate gradients.",
       .places = at<&Median::iterations, &Taubin::iterations, &Flow::iterations, &AnisotropicFlow::iterations,
                    &Diffusion::iterations, &Bilateral::iterations, &Diebel::iterations>(1, 100000)},
      {.name = "flow_step",
       .field = 40,
       .group = kClassical,
       .meaning = "taubin: the factor λ; mean_curvature_flow, anisotropic_flow: time step in squared edge lengths; "
                  "normal_diffusion: time of the normals in an iteration.",
       .places = all(at<&Taubin::step>(0.0001, 0.65),  // beyond, it amplifies every frequency [Taubin 1995]
                     at<&Flow::step, &AnisotropicFlow::step, &Diffusion::step>(0.0001, 1000))},
      {.name = "passband",
       .field = 41,
       .group = kClassical,
       .meaning = "Pass-band frequency 1/λ + 1/μ.",
       .places = at<&Taubin::passband>(0.0001, 0.5)},
      {.name = "spatial_width",
       .field = 42,
       .group = kClassical,
       .unit = kEdgeLengths,
       .meaning = "Width of the spatial Gaussian.",
       .places = at<&NonIterative::spatial_width, &Bilateral::spatial_width>(0.1, 5)},
      {.name = "range_width",
       .field = 43,
       .group = kClassical,
       .unit = kEdgeLengths,
       .meaning = "bilateral: width of the Gaussian of heights; non_iterative: of predictions.",
       .places = at<&NonIterative::range_width, &Bilateral::range_width>(0.001, 100)},
      {.name = "normal_width_deg",
       .field = 44,
       .group = kClassical,
       .unit = kDegrees,
       .meaning = "fuzzy_vector_median: spread of the membership of normals; normal_diffusion: width of the "
                  "conductance; anisotropic_flow: curvature threshold, per edge length.",
       .places =
           degrees_at<&Median::normal_width, &AnisotropicFlow::normal_width, &Diffusion::normal_width>(0.001, 180)},
      {.name = "fitting_steps",
       .field = 45,
       .group = kClassical,
       .unit = "steps",
       .meaning = "Steps in which the vertices follow the filtered normals.",
       .places = at<&Median::fitting_steps, &Diffusion::fitting_steps>(1, 1000)},
      {.name = "diebel_weight",
       .field = 46,
       .group = kClassical,
       .unit = kPerSquare,
       .meaning = "Weight of the squared displacement.",
       .places = at<&Diebel::likelihood_weight>(0.0001, 1000)},
      {.name = "retention_hours",
       .field = 47,
       .group = kJob,
       .unit = "hours",
       .meaning = "How long the service keeps the job after its end, upload and results; then all of it is removed. "
                  "Never changes the result.",
       .places = at<&JobOptions::retention_hours>(0, 8760),
       .changes_result = false},
      {.name = "strength",
       .field = 48,
       .group = kAutomatic,
       .meaning = "How strongly to smooth: 1 as the noise asks for, 0 not at all, 2 as twice the noise would. What has "
                  "been learnt of the errors that are left is put right at 1, and ever less of it towards 0 and 2.",
       .places = at<&Mrf::strength>(0, 2),
       .conditions = {kDescent}},
      {.name = "noise",
       .field = 49,
       .group = kAutomatic,
       .meaning = "Kind of the noise: normal, along the vertex normals; isotropic, in all directions; correlated, over "
                  "several edges, as of scanners; estimated. Meshes of over a million faces never count as correlated.",
       .places = at<&Mrf::noise>(),
       .conditions = {kDescent}},
      {.name = "noise_sigma",
       .field = 50,
       .group = kAutomatic,
       .unit = kEdgeLengths,
       .meaning = "Standard deviation of the noise along the normals; 0: estimated, none below 40 vertices.",
       .places = at<&Mrf::noise_sigma>(0, 10),
       .conditions = {kDescent}},
      {.name = "surface",
       .field = 51,
       .group = kAutomatic,
       .meaning = "What the surface is made of: creases, flat faces that meet in sharp ridges; curved_creases, curved "
                  "faces that do; flats, flat faces that meet at any angle; organic, curved all over; estimated.",
       .places = at<&Mrf::surface>(),
       .conditions = {kDescent}},
      {.name = "weld_tolerance",
       .field = 52,
       .group = kJob,
       .unit = kEdgeLengths,
       .meaning = "Vertices at most this far apart are smoothed as one; 0: those at exactly the same position.",
       .places = at<&SmoothOptions::weld_tolerance>(0, 0.5)},
      {.name = "uncertainty",
       .field = 53,
       .group = kAutomatic,
       .meaning = "Adds how far each vertex may be off along its normal, a posterior standard deviation: _SIGMA in "
                  "glTF, sigma in PLY and JSON, in units of the upload. Changes neither positions nor labels.",
       .places = at<&Mrf::uncertainty>(),
       .conditions = {kDescent}},
  };
}

}  // namespace

const std::vector<Parameter>& parameter_table() {
  static const std::vector<Parameter> table = make_table();
  return table;
}

}  // namespace crease
