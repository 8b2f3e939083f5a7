#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <unordered_map>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/graph/components.h"
#include "colmap_graphmatch/graph/explorer.h"
#include "colmap_graphmatch/graph/graphmatch.h"
#include "colmap_graphmatch/graph/listed_pairs.h"
#include "colmap_graphmatch/graph/propagation.h"
#include "colmap_graphmatch/graph/retrieval.h"
#include "colmap_graphmatch/graph/sampling.h"
#include "colmap_graphmatch/verification/replay_verifier.h"
#include "tests/support/explore.h"
#include "tests/support/recording_verifier.h"
#include "tests/support/reference_graphmatch.h"
#include "tests/support/walk_scene.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::Pair;
using ::testing::SizeIs;

ExplorationResult RunLoop(const GraphMatchOptions& options, const Ranking& ranking,
                          RecordingVerifier* verifier, int num_threads = 2) {
  ThreadPool threads(num_threads);
  return RunGraphMatch(options, ranking, MakeIds(ranking.NumVertices()), *verifier, threads,
                       nullptr);
}

std::vector<std::set<ImagePair>> ReferenceBatches(const GraphMatchOptions& options,
                                                  const Ranking& ranking, const Scene& scene) {
  const std::vector<ImageId> ids = MakeIds(ranking.NumVertices());
  std::vector<std::set<ImagePair>> batches;
  for (const std::set<VertexPair>& batch : ReferenceGraphMatch(options, ranking, scene.edges)) {
    batches.emplace_back();
    for (const auto& [a, b] : batch) batches.back().emplace(ids[a], ids[b]);
  }
  return batches;
}

std::vector<std::set<ImagePair>> AsSets(const std::vector<std::vector<ImagePair>>& batches) {
  std::vector<std::set<ImagePair>> sets;
  for (const std::vector<ImagePair>& batch : batches) sets.emplace_back(batch.begin(), batch.end());
  return sets;
}

TEST(Options, FormulaOfThePaperForMaxTestsForSampling) {
  const GraphMatchOptions options;
  EXPECT_EQ(options.MaxTestsForSampling(569), 10);
  EXPECT_EQ(options.MaxTestsForSampling(1497), 25);
  EXPECT_EQ(options.MaxTestsForSampling(15685), 120);
  EXPECT_EQ(options.TestsInIteration(0, 569), 1);
  EXPECT_EQ(options.TestsInIteration(9, 1497), 2);
  EXPECT_EQ(options.TestsInIteration(10, 1497), 0);
}

TEST(Options, IterationsShareTheBudgetRoundedDown) {
  GraphMatchOptions options;
  options.max_tests_for_sampling = 27;
  EXPECT_EQ(options.TestsInIteration(0, 1000), 2);
  EXPECT_EQ(options.TestsInIteration(9, 1000), 2);
  options.max_tests_for_sampling = 3;
  EXPECT_EQ(options.TestsInIteration(0, 1000), 1);
}

TEST(Options, EveryFieldChangesTheKey) {
  std::set<std::string> keys = {GraphMatchOptions().Key()};
  const std::vector<void (*)(GraphMatchOptions*)> changes = {
      [](GraphMatchOptions* o) { o->number_sample_iterations = 1; },
      [](GraphMatchOptions* o) { o->max_num_neighbors = 1; },
      [](GraphMatchOptions* o) { o->num_to_propagate = 1; },
      [](GraphMatchOptions* o) { o->max_tests_for_sampling = 1; },
      [](GraphMatchOptions* o) { o->max_failed_samples = 1; },
      [](GraphMatchOptions* o) {
        o->restrictions.queries = {true, false};
      },
      [](GraphMatchOptions* o) {
        o->restrictions.queries = {true, true};
      },
      [](GraphMatchOptions* o) {
        o->restrictions.queries = {true, true, true};
      },
      [](GraphMatchOptions* o) {
        o->restrictions.frames = {0, 1};
      },
      [](GraphMatchOptions* o) {
        o->restrictions.frames = {1, 1};
      }};
  for (const auto& change : changes) {
    GraphMatchOptions options;
    change(&options);
    EXPECT_TRUE(keys.insert(options.Key()).second) << options.Key();
    EXPECT_EQ(options.Key(), GraphMatchOptions(options).Key());
  }
}

// With other words the seeds of earlier runs would no longer be found.
TEST(Options, StateFilesHaveTheKeyInTheseWords) {
  EXPECT_EQ(PairRestrictions().Key(), "seeking 0 0, frames 0 0");
  EXPECT_EQ(GraphMatchOptions().Key(),
            "iterations 10, neighbors 120, propagated 4, tests 0, failed 0, "
            "seeking 0 0, frames 0 0");
  PairRestrictions restrictions;
  restrictions.queries = {true, false};
  restrictions.frames = {0, 7, 7};
  EXPECT_EQ(restrictions.Key(), "seeking 2 1489118142, frames 3 3972528079");
}

TEST(Options, RejectsWhatCannotBe) {
  for (const auto& break_option : std::vector<void (*)(GraphMatchOptions*)>{
           [](GraphMatchOptions* o) { o->number_sample_iterations = -1; },
           [](GraphMatchOptions* o) { o->max_num_neighbors = 0; },
           [](GraphMatchOptions* o) { o->num_to_propagate = -1; },
           [](GraphMatchOptions* o) { o->max_tests_for_sampling = -1; },
           [](GraphMatchOptions* o) { o->max_failed_samples = -1; }}) {
    GraphMatchOptions options;
    EXPECT_NO_THROW(options.Check());
    break_option(&options);
    EXPECT_THROW(options.Check(), OptionsError);
  }
}

TEST(MatchingGraph, KeepsTestedPairsAndEdgesApart) {
  MatchingGraph graph(5);
  graph.Add({{{0, 3}, true}, {{0, 1}, false}});
  graph.Add({{{0, 2}, true}, {{1, 4}, true}});
  EXPECT_EQ(graph.NumTested(), 4U);
  EXPECT_EQ(graph.NumEdges(), 3U);
  EXPECT_THAT(graph.Neighbors(0), ElementsAre(2, 3));
  EXPECT_TRUE(graph.IsTested(1, 0));
  EXPECT_TRUE(graph.IsTested(0, 3));
  EXPECT_FALSE(graph.IsTested(3, 4));
  EXPECT_THAT(graph.Edges(), ElementsAre(VertexPair(0, 3), VertexPair(0, 2), VertexPair(1, 4)));
}

TEST(Components, FollowTheEdges) {
  Components components(6);
  EXPECT_EQ(components.NumIsolated(), 6U);
  EXPECT_EQ(components.Largest(), 0U);
  components.AddEdge({0, 1});
  components.AddEdge({2, 3});
  EXPECT_EQ(components.Count(), 2U);
  components.AddEdge({3, 4});
  EXPECT_EQ(components.Largest(), 3U);
  components.AddEdge({2, 4});
  EXPECT_EQ(components.Count(), 2U);
  components.AddEdge({0, 4});
  EXPECT_EQ(components.Count(), 1U);
  EXPECT_EQ(components.Largest(), 5U);
  EXPECT_EQ(components.NumIsolated(), 1U);
}

// Vectors on a quarter circle: the distance of two vertices grows with the difference of their
// numbers.
Scene Fan(std::size_t num_vertices) {
  Scene scene;
  scene.num_vertices = num_vertices;
  scene.vectors.resize(num_vertices * kDim);
  for (std::size_t i = 0; i < num_vertices; ++i) {
    const double angle =
        1.5 * static_cast<double>(i * i) / static_cast<double>(num_vertices * num_vertices);
    scene.vectors[i * kDim] = static_cast<float>(std::cos(angle));
    scene.vectors[i * kDim + 1] = static_cast<float>(std::sin(angle));
  }
  return scene;
}

TEST(Sampling, ProposesTheNextUntestedOfTheRankedList) {
  const VectorRanking ranking = MakeRanking(Fan(5));
  ThreadPool threads(1);
  GraphMatchOptions options;
  Sampler sampler(options, ranking, threads);
  MatchingGraph graph(5);
  EXPECT_THAT(sampler.Propose(0, graph),
              ElementsAre(VertexPair(0, 1), VertexPair(1, 2), VertexPair(2, 3), VertexPair(3, 4)));
  graph.Add({{{0, 1}, false}, {{1, 2}, false}, {{2, 3}, false}, {{3, 4}, true}});
  // 0 goes on to 2, 1 to 3, 2 to 0 (as 0 does), 3 to 1, 4 to 2.
  EXPECT_THAT(sampler.Propose(1, graph),
              ElementsAre(VertexPair(0, 2), VertexPair(1, 3), VertexPair(2, 4)));
}

TEST(Sampling, GoesOnBeyondTheKeptList) {
  const VectorRanking ranking = MakeRanking(Fan(5), 1);
  ThreadPool threads(1);
  Sampler sampler(GraphMatchOptions(), ranking, threads);
  MatchingGraph graph(5);
  graph.Add({{{0, 1}, false}, {{1, 2}, false}, {{2, 3}, false}, {{3, 4}, true}});
  EXPECT_THAT(sampler.Propose(1, graph),
              ElementsAre(VertexPair(0, 2), VertexPair(1, 3), VertexPair(2, 4)));
}

TEST(Sampling, LeavesFullVerticesOut) {
  const VectorRanking ranking = MakeRanking(Fan(4));
  ThreadPool threads(1);
  GraphMatchOptions options;
  options.max_num_neighbors = 1;
  Sampler sampler(options, ranking, threads);
  MatchingGraph graph(4);
  graph.Add({{{0, 1}, true}});
  // 0 and 1 are full and propose nothing; 2 still proposes 1.
  EXPECT_THAT(sampler.Propose(0, graph), ElementsAre(VertexPair(1, 2), VertexPair(2, 3)));
}

TEST(Sampling, StopsAtTheBudget) {
  const VectorRanking ranking = MakeRanking(Fan(30));
  ThreadPool threads(1);
  GraphMatchOptions options;
  options.max_tests_for_sampling = 3;
  Sampler sampler(options, ranking, threads);
  MatchingGraph graph(30);
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(sampler.Propose(i, graph).empty());
  }
  EXPECT_THAT(sampler.Propose(3, graph), IsEmpty());
}

TEST(Propagation, ClosesTriangles) {
  const VectorRanking ranking = MakeRanking(Fan(5));
  ThreadPool threads(1);
  MatchingGraph graph(5);
  graph.Add({{{0, 1}, true}, {{1, 2}, true}, {{2, 3}, false}});
  EXPECT_THAT(Propagate(GraphMatchOptions(), ranking, graph, threads),
              ElementsAre(VertexPair(0, 2)));
  graph.Add({{{0, 2}, false}});
  EXPECT_THAT(Propagate(GraphMatchOptions(), ranking, graph, threads), IsEmpty());
}

TEST(Propagation, HandsOnTheNearestOnly) {
  const VectorRanking ranking = MakeRanking(Fan(10));
  ThreadPool threads(1);
  MatchingGraph graph(10);
  // 9 is a hub of 2 .. 8, and 0 knows it.
  std::vector<TestedVertexPair> pairs = {{{0, 9}, true}};
  for (Vertex v = 2; v < 9; ++v) pairs.push_back({{v, 9}, true});
  graph.Add(pairs);
  GraphMatchOptions options;
  options.num_to_propagate = 2;
  std::set<Vertex> of_zero;
  for (const auto& [a, b] : Propagate(options, ranking, graph, threads)) {
    if (a == 0) of_zero.insert(b);
  }
  // 2 and 3 look most like 0; and 0 is the farthest for all others but 2 and 3, which have nearer
  // ones.
  EXPECT_THAT(of_zero, ElementsAre(2, 3));
}

TEST(Propagation, FullVerticesAreReachedFromOthersOnly) {
  const VectorRanking ranking = MakeRanking(Fan(4));
  ThreadPool threads(1);
  GraphMatchOptions options;
  options.max_num_neighbors = 1;
  MatchingGraph graph(4);
  graph.Add({{{0, 1}, true}, {{1, 2}, true}});
  // All of 0, 1, 2 have a neighbour.
  EXPECT_THAT(Propagate(options, ranking, graph, threads), IsEmpty());
  options.max_num_neighbors = 2;
  EXPECT_THAT(Propagate(options, ranking, graph, threads), ElementsAre(VertexPair(0, 2)));
}

TEST(Propagation, CountsWhatItCouldProposeWithoutALimit) {
  const Scene scene = MakeScene(3, 20, 6, 0.5, 4);
  const VectorRanking ranking = MakeRanking(scene);
  ThreadPool threads(2);
  MatchingGraph graph(scene.num_vertices);
  std::vector<TestedVertexPair> pairs;
  for (const VertexPair& edge : scene.edges) {
    if ((edge.first + edge.second) % 3 != 0) pairs.push_back({edge, edge.second % 4 != 0});
  }
  graph.Add(pairs);
  GraphMatchOptions options;
  options.num_to_propagate = static_cast<int>(scene.num_vertices);
  for (std::size_t v = 0; v < scene.num_vertices; ++v) {
    options.restrictions.queries.push_back(v % 5 != 0);
    options.restrictions.frames.push_back(static_cast<std::uint32_t>(v / 2));
  }
  for (const int max_num_neighbors : {6, 120}) {
    options.max_num_neighbors = max_num_neighbors;
    const std::vector<VertexPair> open = Propagate(options, ranking, graph, threads);
    EXPECT_GT(open.size(), 20U);
    EXPECT_EQ(CountOpenPairs(options, graph, threads), open.size());
  }
}

struct NamedOptions {
  std::string name;
  GraphMatchOptions options;
};

std::vector<NamedOptions> AllChoices() {
  std::vector<NamedOptions> choices = {{"Defaults", {}}};
  const auto add = [&choices](const std::string& name, auto change) {
    choices.push_back({name, {}});
    change(choices.back().options);
  };
  using O = GraphMatchOptions;
  add("BudgetThatIsNoMultiple", [](O& o) { o.max_tests_for_sampling = 17; });
  add("FewerTestsThanIterations", [](O& o) { o.max_tests_for_sampling = 3; });
  add("PropagateOne", [](O& o) { o.num_to_propagate = 1; });
  add("FailedSamples", [](O& o) {
    o.max_failed_samples = 2;
    o.max_tests_for_sampling = 20;
  });
  add("FewNeighbors", [](O& o) { o.max_num_neighbors = 3; });
  add("NoSampling", [](O& o) { o.number_sample_iterations = 0; });
  add("NoPropagation", [](O& o) { o.num_to_propagate = 0; });
  add("ManySamples", [](O& o) { o.max_tests_for_sampling = 60; });
  return choices;
}

class EveryChoice : public ::testing::TestWithParam<NamedOptions> {};

TEST_P(EveryChoice, TestsTheSamePairsAsThePseudoCode) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const Scene scene = MakeScene(6, 14, 4, 0.6, seed);
    const VectorRanking ranking = MakeRanking(scene);
    RecordingVerifier verifier(ImageEdges(scene, MakeIds(scene.num_vertices)));
    const ExplorationResult result = RunLoop(GetParam().options, ranking, &verifier);
    EXPECT_EQ(AsSets(verifier.batches), ReferenceBatches(GetParam().options, ranking, scene));
    EXPECT_TRUE(result.finished);
  }
}

TEST_P(EveryChoice, TestsNoPairTwiceAndKeepsTheDegreeLimit) {
  const Scene scene = MakeScene(5, 20, 8, 0.8, 11);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  const std::set<ImagePair> edges = ImageEdges(scene, ids);
  RecordingVerifier verifier(edges);
  RunLoop(GetParam().options, MakeRanking(scene), &verifier);
  std::set<ImagePair> seen;
  std::map<ImageId, int> degrees;
  for (const std::vector<ImagePair>& batch : verifier.batches) {
    for (const ImagePair& pair : batch) {
      EXPECT_TRUE(seen.insert(pair).second);
      EXPECT_LT(std::min(degrees[pair.id1], degrees[pair.id2]),
                GetParam().options.max_num_neighbors);
    }
    for (const ImagePair& pair : batch) {
      if (edges.count(pair) == 0) continue;
      ++degrees[pair.id1];
      ++degrees[pair.id2];
    }
  }
}

TEST_P(EveryChoice, GivesOneResultForAnyNumberOfThreads) {
  const Scene scene = MakeScene(6, 14, 4, 0.7, 5);
  const VectorRanking ranking = MakeRanking(scene);
  const std::set<ImagePair> edges = ImageEdges(scene, MakeIds(scene.num_vertices));
  RecordingVerifier one(edges);
  RunLoop(GetParam().options, ranking, &one, 1);
  for (const int num_threads : {2, 3, 8, 16}) {
    RecordingVerifier many(edges);
    RunLoop(GetParam().options, ranking, &many, num_threads);
    EXPECT_EQ(many.batches, one.batches) << num_threads;
  }
}

TEST_P(EveryChoice, GoesOnAfterAnInterruptionAsIfThereWasNone) {
  const Scene scene = MakeScene(5, 12, 4, 0.7, 8);
  const VectorRanking ranking = MakeRanking(scene);
  const std::set<ImagePair> edges = ImageEdges(scene, MakeIds(scene.num_vertices));
  RecordingVerifier undisturbed(edges);
  const ExplorationResult expected = RunLoop(GetParam().options, ranking, &undisturbed);
  const std::set<ImagePair> all(undisturbed.tested.begin(), undisturbed.tested.end());
  for (std::size_t stop = 0; stop <= all.size(); stop += 37) {
    RecordingVerifier first(edges);
    first.stop_after = stop;
    EXPECT_EQ(RunLoop(GetParam().options, ranking, &first).finished, stop >= all.size());
    RecordingVerifier second(edges);
    second.known.insert(first.tested.begin(), first.tested.end());
    const ExplorationResult result = RunLoop(GetParam().options, ranking, &second);
    std::set<ImagePair> both(first.tested.begin(), first.tested.end());
    EXPECT_EQ(both.size(), first.tested.size());
    for (const ImagePair& pair : second.tested) EXPECT_TRUE(both.insert(pair).second);
    EXPECT_EQ(both, all) << stop;
    EXPECT_EQ(result.graph.Edges(), expected.graph.Edges());
  }
}

INSTANTIATE_TEST_SUITE_P(Loop, EveryChoice, ::testing::ValuesIn(AllChoices()),
                         [](const auto& choice) { return choice.param.name; });

TEST(Loop, FindsTheWholeGraphOfWellSeparatedPlaces) {
  const Scene scene = MakeScene(12, 20, 5, 0.25, 3);
  RecordingVerifier verifier(ImageEdges(scene, MakeIds(scene.num_vertices)));
  const ExplorationResult result = RunLoop(GraphMatchOptions(), MakeRanking(scene), &verifier);
  EXPECT_EQ(result.graph.NumEdges(), scene.edges.size());
  EXPECT_EQ(result.num_components, 12U);
  EXPECT_EQ(result.largest_component, 20U);
  EXPECT_EQ(result.num_isolated, 0U);
  const StageStatistics all =
      result.stages[LoopStage::kSampling] + result.stages[LoopStage::kPropagation];
  EXPECT_EQ(all.num_edges, scene.edges.size());
  EXPECT_EQ(all.num_tested, verifier.tested.size());
  // Every pair within a place may be worth a test, and sampling tests some between places.
  EXPECT_LT(all.num_tested, 12U * 190U + 240U * 10U);
}

TEST(Loop, StatisticsOfIterationsAddUp) {
  const Scene scene = MakeScene(6, 14, 4, 0.7, 2);
  RecordingVerifier verifier(ImageEdges(scene, MakeIds(scene.num_vertices)));
  const ExplorationResult result = RunLoop(GraphMatchOptions(), MakeRanking(scene), &verifier);
  StageStatistics sampling;
  StageStatistics propagation;
  for (const IterationStatistics& iteration : result.iterations) {
    sampling = sampling + iteration.stages[LoopStage::kSampling];
    propagation = propagation + iteration.stages[LoopStage::kPropagation];
  }
  EXPECT_EQ(sampling.num_tested, result.stages[LoopStage::kSampling].num_tested);
  EXPECT_EQ(propagation.num_tested, result.stages[LoopStage::kPropagation].num_tested);
  EXPECT_EQ(sampling.num_edges + propagation.num_edges, result.graph.NumEdges());
  EXPECT_EQ(result.graph.NumTested(), verifier.tested.size());
}

TEST(Loop, TerminatesOnACompleteGraph) {
  Scene scene = MakeScene(1, 60, 60, 0.5, 4);
  RecordingVerifier verifier(ImageEdges(scene, MakeIds(scene.num_vertices)));
  const ExplorationResult result = RunLoop(GraphMatchOptions(), MakeRanking(scene), &verifier);
  EXPECT_EQ(result.graph.NumEdges(), 60U * 59U / 2U);
}

TEST(Loop, TerminatesWithoutAnyEdge) {
  const Scene scene = MakeScene(4, 10, 0, 0.5, 4);
  RecordingVerifier verifier({});
  const ExplorationResult result = RunLoop(GraphMatchOptions(), MakeRanking(scene), &verifier);
  EXPECT_EQ(result.graph.NumEdges(), 0U);
  EXPECT_EQ(result.num_isolated, 40U);
  EXPECT_EQ(result.iterations.size(), 10U);
}

// Lists and budgets end long before the iterations do.
TEST(Loop, EndsWhenNothingIsLeftToSampleThoughIterationsAre) {
  const Scene scene = MakeScene(4, 10, 4, 0.5, 4);
  const std::set<ImagePair> edges = ImageEdges(scene, MakeIds(scene.num_vertices));
  GraphMatchOptions options;
  options.number_sample_iterations = 1000000000;
  for (const int budget : {10, 1000000000}) {
    options.max_tests_for_sampling = budget;
    RecordingVerifier verifier(edges);
    const ExplorationResult result = RunLoop(options, MakeRanking(scene), &verifier);
    EXPECT_LE(result.iterations.size(), 40U);
    EXPECT_EQ(result.graph.NumTested(), verifier.tested.size());
  }
}

TEST(Loop, GivesUpSamplingOfAnImageThatHasANeighbour) {
  // Places of two: an image's second draw and all later ones are in vain.
  const Scene scene = MakeScene(20, 2, 1, 0.25, 7);
  const std::set<ImagePair> edges = ImageEdges(scene, MakeIds(scene.num_vertices));
  const VectorRanking ranking = MakeRanking(scene);
  GraphMatchOptions options;
  options.num_to_propagate = 0;
  RecordingVerifier all(edges);
  const ExplorationResult spent = RunLoop(options, ranking, &all);
  options.max_failed_samples = 2;
  RecordingVerifier some(edges);
  const ExplorationResult saved = RunLoop(options, ranking, &some);
  EXPECT_EQ(spent.graph.NumEdges(), 20U);
  EXPECT_EQ(saved.graph.NumEdges(), 20U);
  EXPECT_LE(saved.graph.NumTested(), 20U + 40U * 2U);
  EXPECT_GT(spent.graph.NumTested(), 2 * saved.graph.NumTested());
  // Those without a neighbour go on.
  RecordingVerifier none({});
  EXPECT_EQ(RunLoop(options, ranking, &none).iterations.size(), 10U);
}

TEST(Loop, HandlesNoneOneAndTwoImages) {
  for (const int num : {0, 1, 2}) {
    const Scene scene = MakeScene(1, num, 1, 0.1, 6);
    RecordingVerifier verifier(ImageEdges(scene, MakeIds(scene.num_vertices)));
    const ExplorationResult result = RunLoop(GraphMatchOptions(), MakeRanking(scene), &verifier);
    EXPECT_EQ(result.graph.NumEdges(), num == 2 ? 1U : 0U);
    EXPECT_TRUE(result.finished);
  }
}

TEST(Loop, EdgesOfOtherMatchersSeedTheGraph) {
  const Scene scene = MakeScene(4, 12, 11, 0.4, 9);
  const VectorRanking ranking = MakeRanking(scene);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  const std::set<ImagePair> edges = ImageEdges(scene, ids);
  RecordingVerifier verifier(edges);
  // A chain through the first place, as a sequential matcher finds it, and a failed pair between
  // places.
  for (std::size_t i = 0; i + 1 < 12; ++i) verifier.known.emplace(ids[i], ids[i + 1]);
  verifier.known.emplace(ids[0], ids[20]);
  GraphMatchOptions options;
  options.number_sample_iterations = 0;
  const ExplorationResult result = RunLoop(options, ranking, &verifier);
  // Propagation along the chain alone finds the rest of the place, and nothing of it is tested
  // again.
  EXPECT_EQ(result.graph.NumEdges(), 12U * 11U / 2U);
  EXPECT_EQ(result.num_seed_edges, 11U);
  EXPECT_EQ(result.num_seed_pairs, 12U);
  EXPECT_EQ(result.stages[LoopStage::kPropagation].num_tested, 12U * 11U / 2U - 11U);
  for (const ImagePair& pair : verifier.tested) EXPECT_EQ(verifier.known.count(pair), 0U);
}

TEST(Loop, SeedsCountTowardsTheDegreeBeforeTheFirstSample) {
  const Scene scene = MakeScene(2, 10, 9, 0.4, 9);
  const VectorRanking ranking = MakeRanking(scene);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  // Edges of the first image that sampling would not draw: to the images that look least like it.
  std::set<ImagePair> edges = ImageEdges(scene, ids);
  const std::vector<Vertex> farthest = ranking.AllOf(0);
  std::set<ImagePair> known;
  for (std::size_t i = 1; i <= 4; ++i) known.emplace(ids[0], ids[farthest[farthest.size() - i]]);
  edges.insert(known.begin(), known.end());
  RecordingVerifier verifier(edges);
  verifier.known = known;
  GraphMatchOptions options;
  options.max_num_neighbors = 4;
  options.num_to_propagate = 0;
  options.max_tests_for_sampling = 1;
  RunLoop(options, ranking, &verifier);
  ASSERT_THAT(verifier.batches, SizeIs(1));
  // The first image is full: it is tested with those alone that draw it themselves.
  for (const ImagePair& pair : verifier.batches.front()) {
    if (pair.id1 != ids[0]) continue;
    const auto other =
        static_cast<Vertex>(std::find(ids.begin(), ids.end(), pair.id2) - ids.begin());
    EXPECT_EQ(ranking.NearestOf(other).front(), 0U);
  }
  const Vertex nearest = ranking.NearestOf(0).front();
  ASSERT_NE(ranking.NearestOf(nearest).front(), 0U) << "the scene does not show the difference";
}

TEST(Loop, SecondRunTestsNothing) {
  const Scene scene = MakeScene(6, 14, 4, 0.7, 21);
  const VectorRanking ranking = MakeRanking(scene);
  const std::set<ImagePair> edges = ImageEdges(scene, MakeIds(scene.num_vertices));
  RecordingVerifier first(edges);
  const ExplorationResult result = RunLoop(GraphMatchOptions(), ranking, &first);
  RecordingVerifier second(edges);
  second.known.insert(first.tested.begin(), first.tested.end());
  const ExplorationResult again = RunLoop(GraphMatchOptions(), ranking, &second);
  EXPECT_THAT(second.tested, IsEmpty());
  EXPECT_EQ(again.graph.Edges(), result.graph.Edges());
  EXPECT_EQ((again.stages[LoopStage::kSampling] + again.stages[LoopStage::kPropagation]).num_known,
            first.tested.size());
  EXPECT_EQ(again.num_seed_pairs, 0U);
}

TEST(Loop, APairThatFailedIsTheOnlyOneThatTheNextRunTests) {
  const Scene scene = MakeScene(6, 14, 4, 0.7, 21);
  const VectorRanking ranking = MakeRanking(scene);
  std::set<ImagePair> edges = ImageEdges(scene, MakeIds(scene.num_vertices));
  RecordingVerifier probe(edges);
  RunLoop(GraphMatchOptions(), ranking, &probe);
  // One that is no edge: the path of the first run stays right when it is tested at last.
  ImagePair bad;
  for (const ImagePair& pair : probe.batches.front()) {
    if (edges.count(pair) == 0) bad = pair;
  }
  ASSERT_NE(bad.id1, 0U);
  RecordingVerifier first(edges);
  first.failing = {bad};
  const ExplorationResult result = RunLoop(GraphMatchOptions(), ranking, &first);
  EXPECT_THAT(result.failed_pairs, ElementsAre(bad));
  RecordingVerifier second(edges);
  second.known.insert(first.tested.begin(), first.tested.end());
  second.known.erase(bad);
  const ExplorationResult again = RunLoop(GraphMatchOptions(), ranking, &second);
  EXPECT_THAT(second.tested, ElementsAre(bad));
  EXPECT_EQ(again.num_seed_pairs, 0U);
  EXPECT_EQ(again.graph.Edges(), result.graph.Edges());
}

TEST(Loop, RepeatedAfterOtherMatchersItTestsHardlyAnything) {
  const Scene scene = MakeScene(6, 14, 4, 0.7, 22);
  const VectorRanking ranking = MakeRanking(scene);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  const std::set<ImagePair> edges = ImageEdges(scene, ids);
  RecordingVerifier first(edges);
  for (std::size_t i = 0; i + 5 < ids.size(); ++i) first.known.emplace(ids[i], ids[i + 5]);
  RunLoop(GraphMatchOptions(), ranking, &first);
  RecordingVerifier second(edges);
  second.known = first.known;
  second.known.insert(first.tested.begin(), first.tested.end());
  RunLoop(GraphMatchOptions(), ranking, &second);
  EXPECT_LT(second.tested.size(), first.tested.size() / 20);
}

TEST(Loop, NewImagesAreSampledAndOldOnesHardly) {
  const Scene scene = MakeScene(6, 14, 4, 0.7, 23);
  const VectorRanking ranking = MakeRanking(scene);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  const std::set<ImagePair> edges = ImageEdges(scene, ids);
  RecordingVerifier whole(edges);
  RunLoop(GraphMatchOptions(), ranking, &whole);
  // Two images of the third place are new: nothing of them was tested.
  const std::set<ImageId> added = {ids[30], ids[35]};
  RecordingVerifier second(edges);
  for (const ImagePair& pair : whole.tested) {
    if (added.count(pair.id1) + added.count(pair.id2) == 0) second.known.insert(pair);
  }
  const ExplorationResult result = RunLoop(GraphMatchOptions(), ranking, &second);
  std::size_t of_old_images = 0;
  for (const ImagePair& pair : second.tested) {
    of_old_images += added.count(pair.id1) + added.count(pair.id2) == 0 ? 1U : 0U;
  }
  EXPECT_LT(of_old_images, second.tested.size());
  EXPECT_LT(second.tested.size(), whole.tested.size() / 4);
  EXPECT_GT(result.graph.Degree(30), 0U);
  EXPECT_GT(result.graph.Degree(35), 0U);
}

// The scene without some of its vertices.
Scene Without(const Scene& scene, const std::set<Vertex>& removed) {
  Scene rest;
  std::vector<Vertex> numbers(scene.num_vertices);
  for (Vertex vertex = 0; vertex < scene.num_vertices; ++vertex) {
    if (removed.count(vertex) > 0) continue;
    numbers[vertex] = static_cast<Vertex>(rest.num_vertices++);
    const auto row = scene.vectors.begin() + static_cast<std::ptrdiff_t>(vertex * kDim);
    rest.vectors.insert(rest.vectors.end(), row, row + kDim);
  }
  for (const auto& [a, b] : scene.edges) {
    if (removed.count(a) + removed.count(b) == 0) rest.edges.emplace(numbers[a], numbers[b]);
  }
  return rest;
}

TEST(Loop, ImagesThatWereSampledLeaveSamplingToNewOnes) {
  const Scene scene = MakeScene(6, 14, 4, 0.7, 23);
  const std::set<Vertex> added = {30, 35, 36};
  std::vector<ImageId> old_ids;
  std::set<ImageId> new_ids;
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  for (Vertex vertex = 0; vertex < ids.size(); ++vertex) {
    if (added.count(vertex) > 0) {
      new_ids.insert(ids[vertex]);
    } else {
      old_ids.push_back(ids[vertex]);
    }
  }
  ThreadPool threads(2);
  const std::set<ImagePair> edges = ImageEdges(scene, ids);
  for (const bool with_frames : {false, true}) {
    GraphMatchOptions options;
    if (with_frames) {
      for (Vertex vertex = 0; vertex < old_ids.size(); ++vertex) {
        options.restrictions.frames.push_back(1 + vertex / 4);
      }
    } else {
      options.max_tests_for_sampling = 15;
    }
    RecordingVerifier first(edges);
    RunGraphMatch(options, MakeRanking(Without(scene, added)), old_ids, first, threads, nullptr);
    RecordingVerifier second(edges);
    second.known.insert(first.tested.begin(), first.tested.end());
    if (with_frames) {
      // The new images have no frame.
      for (const Vertex vertex : added) {
        options.restrictions.frames.insert(options.restrictions.frames.begin() + vertex, 0);
      }
    }
    const ExplorationResult result = RunLoop(options, MakeRanking(scene), &second);
    ASSERT_THAT(second.batches, Not(IsEmpty()));
    for (const ImagePair& pair : second.batches.front()) {
      EXPECT_GT(new_ids.count(pair.id1) + new_ids.count(pair.id2), 0U);
    }
    for (const Vertex vertex : added) EXPECT_GT(result.graph.Degree(vertex), 0U);
    EXPECT_LT(second.tested.size(), first.tested.size() / 4);
  }
}

TEST(Loop, InterruptedAfterOtherMatchersItEndsAsIfItHadNotBeen) {
  const Scene scene = MakeScene(6, 14, 4, 0.7, 22);
  const VectorRanking ranking = MakeRanking(scene);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  const std::set<ImagePair> edges = ImageEdges(scene, ids);
  std::set<ImagePair> others;
  for (std::size_t i = 0; i + 5 < ids.size(); ++i) others.emplace(ids[i], ids[i + 5]);
  ThreadPool threads(2);
  const GraphMatchOptions options;
  RecordingVerifier whole(edges);
  whole.known = others;
  RunLoop(options, ranking, &whole);
  std::set<ImagePair> expected(whole.tested.begin(), whole.tested.end());
  expected.insert(others.begin(), others.end());
  for (std::size_t stop_after = 0; stop_after < whole.tested.size(); stop_after += 23) {
    // Twice interrupted; what is kept between the runs is the seeds.
    std::set<ImagePair> known = others;
    std::vector<ImagePair> seeds;
    for (const std::size_t num : {stop_after, std::size_t{17}, whole.tested.size()}) {
      RecordingVerifier verifier(edges);
      verifier.known = known;
      verifier.stop_after = num;
      seeds = ChooseGraphMatchSeeds(options, ranking, ids, verifier, threads, seeds);
      EXPECT_THAT(seeds, ElementsAreArray(others));
      RunGraphMatch(options, ranking, ids, verifier, threads, nullptr, seeds);
      known.insert(verifier.tested.begin(), verifier.tested.end());
    }
    EXPECT_EQ(known, expected) << "after " << stop_after;
  }
}

TEST(Loop, OnlyQueryImagesLookForPartners) {
  const Scene scene = MakeScene(6, 14, 4, 0.7, 24);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  GraphMatchOptions options;
  options.restrictions.queries.resize(scene.num_vertices);
  const std::set<Vertex> queries = {3, 40, 41};
  std::set<ImageId> query_ids;
  for (const Vertex vertex : queries) {
    options.restrictions.queries[vertex] = true;
    query_ids.insert(ids[vertex]);
  }
  // The others have been matched: what they found leads on.
  RecordingVerifier verifier(ImageEdges(scene, ids));
  for (const ImagePair& pair : ImageEdges(scene, ids)) {
    if (query_ids.count(pair.id1) + query_ids.count(pair.id2) == 0) verifier.known.insert(pair);
  }
  const ExplorationResult result = RunLoop(options, MakeRanking(scene), &verifier);
  EXPECT_THAT(verifier.tested, Not(IsEmpty()));
  for (const ImagePair& pair : verifier.tested) {
    EXPECT_GT(query_ids.count(pair.id1) + query_ids.count(pair.id2), 0U);
  }
  for (const Vertex vertex : queries) EXPECT_GT(result.graph.Degree(vertex), 3U);
  EXPECT_GT(result.stages[LoopStage::kPropagation].num_tested, 0U);

  RecordingVerifier exhaustive(ImageEdges(scene, ids));
  VerifyAllPairs(ids, exhaustive, nullptr, options.restrictions);
  EXPECT_EQ(exhaustive.tested.size(), 3 * (ids.size() - 1) - 3);
}

TEST(Loop, PairsOfOneFrameAreNotTested) {
  const Scene scene = MakeScene(4, 12, 11, 0.5, 25);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  GraphMatchOptions options;
  // Frames of three images; some images have none.
  std::map<ImageId, std::uint32_t> frames;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    options.restrictions.frames.push_back(i % 12 < 6 ? static_cast<std::uint32_t>(1 + i / 3) : 0);
    frames[ids[i]] = options.restrictions.frames.back();
  }
  std::size_t num_within = 0;
  RecordingVerifier verifier(ImageEdges(scene, ids));
  const ExplorationResult result = RunLoop(options, MakeRanking(scene), &verifier);
  for (const ImagePair& pair : verifier.tested) {
    num_within += frames[pair.id1] != 0 && frames[pair.id1] == frames[pair.id2] ? 1U : 0U;
  }
  EXPECT_EQ(num_within, 0U);
  // Eight frames of three pairs each are left out; all other edges are found.
  EXPECT_EQ(result.graph.NumEdges(), scene.edges.size() - 8U * 3U);
  RecordingVerifier exhaustive(ImageEdges(scene, ids));
  const ExplorationResult all = VerifyAllPairs(ids, exhaustive, nullptr, options.restrictions);
  EXPECT_EQ(exhaustive.tested.size(), 48U * 47U / 2U - 8U * 3U);
  EXPECT_EQ(all.graph.NumEdges(), scene.edges.size() - 8U * 3U);
}

TEST(Loop, PairsThatCannotBeTestedAreReportedOnceAndAreNoEdges) {
  const Scene scene = MakeScene(3, 10, 9, 0.3, 13);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  RecordingVerifier verifier(ImageEdges(scene, ids));
  const ImagePair bad(ids[0], ids[1]);
  verifier.failing = {bad};
  const ExplorationResult result = RunLoop(GraphMatchOptions(), MakeRanking(scene), &verifier);
  EXPECT_THAT(result.failed_pairs, ElementsAre(bad));
  EXPECT_EQ(std::count(verifier.tested.begin(), verifier.tested.end(), bad), 1);
  EXPECT_EQ(result.graph.NumEdges(), scene.edges.size() - 1);
  EXPECT_EQ(
      (result.stages[LoopStage::kSampling] + result.stages[LoopStage::kPropagation]).num_failed,
      1U);
}

TEST(Loop, KnownPairsOfUnrankedImagesAreLeftAside) {
  const Scene scene = MakeScene(2, 6, 2, 0.3, 14);
  RecordingVerifier verifier(ImageEdges(scene, MakeIds(scene.num_vertices)));
  verifier.known = {ImagePair(1, 2), ImagePair(7, 8), ImagePair(1000, 2000), ImagePair(10, 10)};
  const ExplorationResult result = RunLoop(GraphMatchOptions(), MakeRanking(scene), &verifier);
  EXPECT_EQ(result.num_seed_pairs, 0U);
  EXPECT_TRUE(result.finished);
}

TEST(Loop, ProgressGrowsAndEndsAtTheResult) {
  const Scene scene = MakeScene(5, 12, 4, 0.5, 15);
  const VectorRanking ranking = MakeRanking(scene);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  RecordingVerifier verifier(ImageEdges(scene, ids));
  ThreadPool threads(2);
  LoopProgress last;
  std::size_t calls = 0;
  const ExplorationResult result = RunGraphMatch(GraphMatchOptions(), ranking, ids, verifier,
                                                 threads, [&](const LoopProgress& progress) {
                                                   EXPECT_GE(progress.num_edges, last.num_edges);
                                                   EXPECT_EQ(progress.all.num_tested, calls + 1);
                                                   last = progress;
                                                   ++calls;
                                                 });
  EXPECT_EQ(calls, verifier.tested.size());
  EXPECT_EQ(last.num_edges, result.graph.NumEdges());
  EXPECT_EQ(last.num_components, result.num_components);
  EXPECT_EQ(last.num_isolated, result.num_isolated);
}

TEST(Loop, ExpectsAboutAsManyTestsAsCome) {
  const Scene scene = MakeScene(12, 25, 8, 0.5, 15);
  const VectorRanking ranking = MakeRanking(scene);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  RecordingVerifier verifier(ImageEdges(scene, ids));
  ThreadPool threads(2);
  std::vector<std::size_t> expected;
  RunGraphMatch(
      GraphMatchOptions(), ranking, ids, verifier, threads,
      [&](const LoopProgress& progress) { expected.push_back(progress.expected_remaining_tests); });
  ASSERT_GT(expected.size(), 2000U);
  for (std::size_t i = expected.size() / 5; i < expected.size(); ++i) {
    const std::size_t to_come = expected.size() - i - 1;
    EXPECT_NEAR(static_cast<double>(expected[i]), static_cast<double>(to_come),
                0.35 * static_cast<double>(to_come) + 30);
  }
  EXPECT_EQ(expected.back(), 0U);
}

TEST(Loop, NeedsAnIdForEveryImage) {
  const Scene scene = MakeScene(1, 4, 1, 0.3, 1);
  const VectorRanking ranking = MakeRanking(scene);
  RecordingVerifier verifier({});
  ThreadPool threads(1);
  EXPECT_THROW(RunGraphMatch({}, ranking, {1, 2}, verifier, threads, nullptr), OptionsError);
  EXPECT_THROW(RunGraphMatch({}, ranking, {4, 3, 2, 1}, verifier, threads, nullptr), OptionsError);
}

// Retrieval and query expansion as the paper says it, pair by pair.
std::vector<std::set<ImagePair>> ReferenceRetrieval(const RetrievalOptions& options,
                                                    const Ranking& ranking, const Scene& scene) {
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  std::set<VertexPair> tested;
  std::vector<std::set<ImagePair>> batches;
  const auto test = [&](const std::set<VertexPair>& pairs) {
    tested.insert(pairs.begin(), pairs.end());
    batches.emplace_back();
    for (const auto& [a, b] : pairs) batches.back().emplace(ids[a], ids[b]);
  };
  std::set<VertexPair> pairs;
  for (Vertex a = 0; a < scene.num_vertices; ++a) {
    const std::vector<Vertex> all = ranking.AllOf(a);
    for (std::size_t i = 0; i < std::min<std::size_t>(all.size(), options.num_images); ++i) {
      pairs.insert(MakeVertexPair(a, all[i]));
    }
  }
  test(pairs);
  for (int round = 0; round < options.num_expansions; ++round) {
    const auto is_found = [&](Vertex a, Vertex b) {
      return tested.count(MakeVertexPair(a, b)) > 0 && scene.edges.count(MakeVertexPair(a, b)) > 0;
    };
    pairs.clear();
    for (Vertex i = 0; i < scene.num_vertices; ++i) {
      for (Vertex k = i + 1; k < scene.num_vertices; ++k) {
        for (Vertex j = 0; j < scene.num_vertices; ++j) {
          if (j == i || j == k || !is_found(i, j) || !is_found(j, k)) continue;
          if (tested.count({i, k}) == 0) pairs.emplace(i, k);
        }
      }
    }
    if (pairs.empty()) break;
    test(pairs);
  }
  return batches;
}

TEST(Retrieval, TestsTheNearestImagesAndThenNeighborsOfNeighbors) {
  const Scene scene = MakeScene(5, 12, 3, 0.6, 31);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  for (const std::size_t list_length : {3, 512}) {
    const VectorRanking ranking = MakeRanking(scene, list_length);
    for (const int num_images : {1, 4, 1000}) {
      for (const int num_expansions : {0, 2, 50}) {
        RetrievalOptions options;
        options.num_images = num_images;
        options.num_expansions = num_expansions;
        ThreadPool threads(2);
        RecordingVerifier verifier(ImageEdges(scene, ids));
        const ExplorationResult result =
            RunRetrieval(options, ranking, ids, verifier, threads, nullptr);
        const auto expected = ReferenceRetrieval(options, ranking, scene);
        EXPECT_EQ(AsSets(verifier.batches), expected) << num_images << " " << num_expansions;
        EXPECT_EQ(result.stages[LoopStage::kRetrieval].num_tested, expected.front().size());
        EXPECT_EQ(result.stages.All().num_tested, verifier.tested.size());
      }
    }
  }
}

TEST(Retrieval, GoesOnAfterAnInterruption) {
  const Scene scene = MakeScene(5, 12, 3, 0.6, 32);
  const VectorRanking ranking = MakeRanking(scene);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  ThreadPool threads(2);
  RetrievalOptions options;
  options.num_images = 3;
  options.num_expansions = 4;
  RecordingVerifier whole(ImageEdges(scene, ids));
  const ExplorationResult expected = RunRetrieval(options, ranking, ids, whole, threads, nullptr);
  ASSERT_GT(expected.stages[LoopStage::kExpansion].num_tested, 10U);
  for (std::size_t stop_after = 0; stop_after < whole.tested.size(); stop_after += 37) {
    RecordingVerifier first(ImageEdges(scene, ids));
    first.stop_after = stop_after;
    EXPECT_FALSE(RunRetrieval(options, ranking, ids, first, threads, nullptr).finished);
    RecordingVerifier second(ImageEdges(scene, ids));
    second.known.insert(first.tested.begin(), first.tested.end());
    const ExplorationResult result = RunRetrieval(options, ranking, ids, second, threads, nullptr);
    EXPECT_EQ(result.graph.Edges(), expected.graph.Edges());
    EXPECT_EQ(first.tested.size() + second.tested.size(), whole.tested.size());
  }
}

TEST(Retrieval, KeepsToItsRestrictions) {
  const Scene scene = MakeScene(3, 12, 11, 0.4, 33);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  ThreadPool threads(2);
  RetrievalOptions options;
  options.num_images = 4;
  options.num_expansions = 4;
  options.restrictions.queries.resize(scene.num_vertices);
  options.restrictions.queries[7] = true;
  options.restrictions.frames.resize(scene.num_vertices);
  options.restrictions.frames[7] = options.restrictions.frames[8] = 5;
  RecordingVerifier verifier(ImageEdges(scene, ids));
  RunRetrieval(options, MakeRanking(scene), ids, verifier, threads, nullptr);
  EXPECT_GE(verifier.tested.size(), 3U);
  for (const ImagePair& pair : verifier.tested) {
    EXPECT_TRUE(pair.id1 == ids[7] || pair.id2 == ids[7]);
    EXPECT_NE(pair, ImagePair(ids[7], ids[8]));
  }
}

TEST(Retrieval, RefusesOptionsThatMeanNothing) {
  RetrievalOptions options;
  options.num_images = 0;
  EXPECT_THROW(options.Check(), OptionsError);
  options.num_images = 1;
  options.num_expansions = -1;
  EXPECT_THROW(options.Check(), OptionsError);
}

TEST(ListedPairs, AllPairsOfTheImagesInBlocks) {
  // Three blocks of 256 images at most.
  std::vector<ImageId> ids;
  for (ImageId i = 0; i < 600; ++i) ids.push_back(3 * i + 1);
  RecordingVerifier verifier({ImagePair(1, 4), ImagePair(4, 1795)});
  verifier.known = {ImagePair(1, 4), ImagePair(1, 7), ImagePair(2, 3)};
  std::size_t last_remaining = 0;
  std::size_t calls = 0;
  const ExplorationResult result = VerifyAllPairs(ids, verifier, [&](const LoopProgress& progress) {
    EXPECT_EQ(progress.stage, LoopStage::kListed);
    EXPECT_EQ(progress.expected_remaining_tests + ++calls, 600U * 599 / 2);
    last_remaining = progress.expected_remaining_tests;
  });
  EXPECT_EQ(last_remaining, 0U);
  EXPECT_EQ(verifier.tested.size(), 600U * 599 / 2 - 2);
  EXPECT_EQ(std::set<ImagePair>(verifier.tested.begin(), verifier.tested.end()).size(),
            verifier.tested.size());
  EXPECT_EQ(verifier.batches.size(), 6U);
  EXPECT_EQ(result.num_seed_pairs, 0U);
  EXPECT_EQ(result.stages[LoopStage::kListed].num_known, 2U);
  EXPECT_EQ(result.stages[LoopStage::kListed].num_known_edges, 1U);
  EXPECT_EQ(result.stages[LoopStage::kListed].num_tested, verifier.tested.size());
  EXPECT_EQ(result.graph.NumEdges(), 2U);
  EXPECT_EQ(result.num_components, 1U);
  EXPECT_EQ(result.largest_component, 3U);
  EXPECT_EQ(result.num_isolated, 597U);
  EXPECT_TRUE(result.finished);
}

TEST(ListedPairs, NoImagesOrOne) {
  RecordingVerifier verifier({});
  EXPECT_TRUE(VerifyAllPairs({}, verifier, nullptr).finished);
  EXPECT_EQ(VerifyAllPairs({5}, verifier, nullptr).num_isolated, 1U);
  EXPECT_THAT(verifier.tested, IsEmpty());
}

TEST(ListedPairs, StopsBetweenBlocks) {
  std::vector<ImageId> ids(600);
  std::iota(ids.begin(), ids.end(), ImageId{1});
  RecordingVerifier verifier({});
  verifier.stop_after = 40000;
  EXPECT_FALSE(VerifyAllPairs(ids, verifier, nullptr).finished);
  EXPECT_EQ(verifier.tested.size(), 40000U);
  EXPECT_EQ(verifier.batches.size(), 2U);
}

TEST(ListedPairs, ThoseOfAList) {
  RecordingVerifier verifier({ImagePair(2, 5)});
  verifier.known = {ImagePair(2, 9), ImagePair(9, 12)};
  // Twice, known, of an image with itself, and of an image that is not there.
  const std::vector<ImagePair> list = {ImagePair(9, 5), ImagePair(5, 2), ImagePair(2, 5),
                                       ImagePair(9, 2), ImagePair(5, 5), ImagePair(2, 7)};
  const ExplorationResult result = VerifyListedPairs(list, {2, 5, 9, 12}, verifier, nullptr);
  EXPECT_THAT(verifier.batches,
              ElementsAre(ElementsAre(ImagePair(2, 5), ImagePair(2, 9), ImagePair(5, 9))));
  EXPECT_EQ(result.stages[LoopStage::kListed].num_known, 1U);
  EXPECT_EQ(result.stages[LoopStage::kListed].num_tested, 2U);
  EXPECT_EQ(result.stages[LoopStage::kListed].num_edges, 1U);
  EXPECT_EQ(result.num_seed_pairs, 1U);
}

// Proposes one pair after the other, and keeps what it is told.
class ListeningProposer : public PairProposer {
 public:
  explicit ListeningProposer(std::vector<VertexPair> pairs) : pairs_(std::move(pairs)) {}

  std::optional<Proposal> Next(const MatchingGraph& /*graph*/) override {
    if (next_ == pairs_.size()) return std::nullopt;
    return Proposal{{pairs_[next_++]}, LoopStage::kListed, 0};
  }
  void OnVerified(const TestedVertexPair& pair, const InlierReader& inliers) override {
    told[pair.pair] = inliers();
  }

  std::map<VertexPair, FeatureMatches> told;

 private:
  std::vector<VertexPair> pairs_;
  std::size_t next_ = 0;
};

TEST(Explore, ProposersLearnTheInliersOfEveryPair) {
  RecordingVerifier verifier({ImagePair(10, 20), ImagePair(20, 30), ImagePair(30, 40)});
  verifier.known = {ImagePair(20, 30), ImagePair(10, 40), ImagePair(30, 40)};
  ListeningProposer proposer({{0, 1}, {0, 2}, {2, 3}});
  Explore(proposer, {10, 20, 30, 40}, verifier, {}, {{ImagePair(20, 30)}, true});
  const auto one = [](ImageId a, ImageId b) { return FeatureMatches{{a, b}}; };
  EXPECT_THAT(proposer.told,
              ElementsAre(Pair(VertexPair(0, 1), one(10, 20)), Pair(VertexPair(0, 2), IsEmpty()),
                          Pair(VertexPair(0, 3), IsEmpty()), Pair(VertexPair(1, 2), one(20, 30)),
                          Pair(VertexPair(2, 3), one(30, 40))));
}

TEST(Explore, RefusesAProposalThatDoesNotAscend) {
  class OneProposal : public PairProposer {
   public:
    explicit OneProposal(std::vector<VertexPair> pairs) : pairs_(std::move(pairs)) {}
    std::optional<Proposal> Next(const MatchingGraph& /*graph*/) override {
      return Proposal{pairs_, LoopStage::kListed, 0};
    }

   private:
    std::vector<VertexPair> pairs_;
  };
  for (const std::vector<VertexPair>& pairs :
       {std::vector<VertexPair>{{0, 2}, {0, 1}}, std::vector<VertexPair>{{0, 1}, {0, 1}}}) {
    OneProposal proposer(pairs);
    RecordingVerifier verifier({});
    EXPECT_THROW(Explore(proposer, {10, 20, 30}, verifier, {}), std::logic_error);
    EXPECT_THAT(verifier.batches, IsEmpty());
  }
}

TEST(LoopStage, EveryStageHasItsPlaceAndItsName) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < kLoopStages.size(); ++i) {
    EXPECT_EQ(static_cast<std::size_t>(kLoopStages[i]), i);
    EXPECT_TRUE(names.insert(StageName(kLoopStages[i])).second);
  }
  EXPECT_EQ(names.count("unknown"), 0U);
}

TEST(ReplayVerifier, AnswersFromTheGraph) {
  ReplayVerifier verifier({{ImagePair(1, 2), 30}});
  EXPECT_THAT(verifier.KnownPairs(), IsEmpty());
  std::vector<PairOutcome> outcomes;
  EXPECT_TRUE(verifier.Verify({ImagePair(1, 2), ImagePair(2, 3)},
                              [&](const VerifiedPair& pair) { outcomes.push_back(pair.outcome); }));
  EXPECT_THAT(outcomes, ElementsAre(PairOutcome::kEdge, PairOutcome::kNoEdge));
}

}  // namespace
}  // namespace colmap_graphmatch
