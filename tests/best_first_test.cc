#include "colmap_graphmatch/graph/best_first.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "colmap_graphmatch/base/errors.h"
#include "colmap_graphmatch/base/random.h"
#include "colmap_graphmatch/graph/explorer.h"
#include "colmap_graphmatch/graph/seeds.h"
#include "colmap_graphmatch/ranking/list_ranking.h"
#include "tests/support/explore.h"
#include "tests/support/recording_verifier.h"
#include "tests/support/walk_scene.h"

namespace colmap_graphmatch {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const ImagePriors kNoPriors;

ExplorationResult RunBestFirst(const BestFirstOptions& options, const Ranking& ranking,
                               RecordingVerifier* verifier, int num_threads = 2,
                               const ImagePriors& priors = kNoPriors) {
  ThreadPool threads(num_threads);
  const std::vector<ImageId> ids = MakeIds(ranking.NumVertices());
  const auto make = [&] {
    return std::make_unique<BestFirstProposer>(options, ranking, priors, threads);
  };
  const std::unique_ptr<PairProposer> proposer = make();
  return Explore(*proposer, ids, *verifier, nullptr,
                 {ChooseSeeds(make, ids, *verifier, {}, StopRequest())});
}

// By vertex, with ids from 1 on.
std::vector<ImageRecord> MakeImages(const std::vector<std::string>& names) {
  std::vector<ImageRecord> images;
  for (const std::string& name : names) {
    images.push_back({static_cast<ImageId>(images.size() + 1), name, 1, 1});
  }
  return images;
}

// A graph of random tests with random inliers, and the same as plain sets.
struct RandomGraph {
  MatchingGraph graph{0};
  SharedTracks tracks{0};
  std::vector<TestedVertexPair> tested;  // Ascending.
  std::map<VertexPair, FeatureMatches> inliers;
};

RandomGraph MakeRandomGraph(std::size_t num_vertices, double share_tested, std::uint64_t seed,
                            const std::set<VertexPair>& left_out = {}) {
  Random random({seed});
  RandomGraph made;
  made.graph = MatchingGraph(num_vertices);
  made.tracks = SharedTracks(num_vertices);
  for (Vertex a = 0; a < num_vertices; ++a) {
    for (Vertex b = a + 1; b < num_vertices; ++b) {
      if (random.Uniform() >= share_tested) continue;
      const bool is_edge = random.Uniform() < 0.6;
      FeatureMatches matches;
      // Beyond 64 bits, and some edges without inliers.
      const std::uint64_t num_matches = is_edge ? random.Index(40) : 0;
      for (std::uint64_t i = 0; i < num_matches; ++i) {
        matches.push_back({static_cast<std::uint32_t>(random.Index(150)),
                           static_cast<std::uint32_t>(random.Index(150))});
      }
      if (left_out.count({a, b}) > 0) continue;
      made.tested.push_back({{a, b}, is_edge});
      if (!is_edge) continue;
      made.tracks.Add({a, b}, matches);
      made.inliers[{a, b}] = matches;
    }
  }
  made.graph.Add(made.tested);
  return made;
}

// The features of a vertex that are inliers with a neighbour.
std::set<std::uint32_t> FeaturesOf(const RandomGraph& graph, Vertex vertex, Vertex neighbor) {
  std::set<std::uint32_t> features;
  for (const FeatureMatch& match : graph.inliers.at(MakeVertexPair(vertex, neighbor))) {
    features.insert(vertex < neighbor ? match.feature1 : match.feature2);
  }
  return features;
}

// What PairEvidence says of its counts, from the definitions.
struct Counts {
  double num_common = 0;
  double num_failed = 0;
  double num_shared = 0;
  double most_shared = 0;
};

Counts CountPlainly(const RandomGraph& random, Vertex a, Vertex c) {
  std::map<VertexPair, bool> tests;
  for (const TestedVertexPair& tested : random.tested) tests[tested.pair] = tested.is_edge;
  const auto has = [&](Vertex x, Vertex y, bool is_edge) {
    const auto found = tests.find(MakeVertexPair(x, y));
    return x != y && found != tests.end() && found->second == is_edge;
  };
  Counts counts;
  for (Vertex b = 0; b < random.graph.NumVertices(); ++b) {
    if (b == a || b == c) continue;
    if (has(a, b, true) && has(b, c, false)) ++counts.num_failed;
    if (has(a, b, false) && has(b, c, true)) ++counts.num_failed;
    if (!has(a, b, true) || !has(b, c, true)) continue;
    ++counts.num_common;
    double num_shared = 0;
    const std::set<std::uint32_t> with_c = FeaturesOf(random, b, c);
    for (const std::uint32_t feature : FeaturesOf(random, b, a)) {
      num_shared += static_cast<double>(with_c.count(feature));
    }
    counts.num_shared += num_shared;
    counts.most_shared = std::max(counts.most_shared, num_shared);
  }
  return counts;
}

TEST(SharedTracks, CountsFeaturesThatAreInliersOfBothEdges) {
  SharedTracks tracks(4);
  tracks.Add({0, 1}, {{0, 5}, {1, 70}, {2, 9}});
  tracks.Add({1, 2}, {{70, 3}, {9, 4}, {8, 5}});
  tracks.Add({1, 3}, {{8, 1}});
  const auto count = [&](Vertex a, Vertex b, Vertex c) {
    return SharedTracks::CountShared(tracks.Inliers(b, a), tracks.Inliers(b, c));
  };
  EXPECT_EQ(count(0, 1, 2), 2U);
  EXPECT_EQ(count(3, 1, 2), 1U);
  EXPECT_EQ(count(0, 1, 3), 0U);
  EXPECT_EQ(count(0, 2, 1), 0U);  // 0 and 2 are no edge.
}

TEST(SharedTracks, CountsEveryFeatureOfLargeImages) {
  Random random({9});
  for (const std::uint32_t num_features : {1U, 63U, 64U, 65U, 1000U, 8192U}) {
    SharedTracks tracks(3);
    FeatureMatches of_first;
    FeatureMatches of_second;
    std::size_t num_shared = 0;
    for (std::uint32_t feature = 0; feature < num_features; ++feature) {
      const bool in_first = random.Uniform() < 0.7;
      const bool in_second = random.Uniform() < 0.7;
      if (in_first) of_first.push_back({0, feature});
      if (in_second) of_second.push_back({feature, 0});
      if (in_first && in_second) ++num_shared;
    }
    tracks.Add({0, 1}, of_first);
    tracks.Add({1, 2}, of_second);
    EXPECT_EQ(SharedTracks::CountShared(tracks.Inliers(1, 0), tracks.Inliers(1, 2)), num_shared);
  }
}

TEST(SharedTracks, FeaturesThatNoImageHasTakeNoMemory) {
  SharedTracks tracks(3);
  tracks.Add({0, 1}, {{0xFFFFFFFF, 0xFFFFFFFF}});
  EXPECT_THAT(tracks.Inliers(0, 1), IsEmpty());
  EXPECT_THAT(tracks.Inliers(1, 0), IsEmpty());
}

// Tells the evidence of the tests of a random graph, in so many steps.
void AddInSteps(const RandomGraph& random, std::size_t num_steps, PairEvidence* evidence) {
  RandomGraph part;
  part.graph = MatchingGraph(random.graph.NumVertices());
  part.tracks = SharedTracks(random.graph.NumVertices());
  for (std::size_t step = 0; step < num_steps; ++step) {
    std::vector<TestedVertexPair> tests;
    for (std::size_t i = step; i < random.tested.size(); i += num_steps) {
      tests.push_back(random.tested[i]);
      if (tests.back().is_edge) {
        part.tracks.Add(tests.back().pair, random.inliers.at(tests.back().pair));
      }
    }
    part.graph.Add(tests);
    evidence->Add(tests, part.graph, part.tracks);
  }
}

std::vector<Candidate> Collect(const PairEvidence& evidence, std::size_t num_nearest,
                               const MatchingGraph& graph, std::size_t num_near = 0) {
  std::vector<std::vector<Candidate>> parts(evidence.NumTasks());
  evidence.VisitCandidates(
      num_nearest, num_near, graph,
      [&](std::size_t task, const Candidate& candidate) { parts[task].push_back(candidate); });
  std::vector<Candidate> candidates;
  for (const std::vector<Candidate>& part : parts) {
    candidates.insert(candidates.end(), part.begin(), part.end());
  }
  return candidates;
}

PairRestrictions EveryThirdIsAQuery(std::size_t num_vertices) {
  PairRestrictions restrictions;
  restrictions.queries.resize(num_vertices);
  restrictions.frames.resize(num_vertices);
  for (std::size_t i = 0; i < num_vertices; ++i) {
    restrictions.queries[i] = i % 3 == 0;
    restrictions.frames[i] = static_cast<std::uint32_t>(i / 4);
  }
  return restrictions;
}

TEST(PairEvidence, VisitsWhatTheDefinitionsSay) {
  const Scene scene = MakeScene(4, 8, 3, 0.5, 1);
  const VectorRanking ranking = MakeRanking(scene);
  ThreadPool threads(2);
  for (const PairRestrictions& restrictions :
       {PairRestrictions(), EveryThirdIsAQuery(scene.num_vertices)}) {
    for (const std::uint64_t seed : {1, 2, 3}) {
      const RandomGraph random = MakeRandomGraph(scene.num_vertices, 0.15, seed);
      PairEvidence evidence(ranking, kNoPriors, restrictions, threads);
      AddInSteps(random, seed, &evidence);
      const auto may_be_tested = [&](Vertex a, Vertex c) {
        return a != c && restrictions.Allows(a, c) && !random.graph.IsTested(a, c);
      };
      std::set<VertexPair> expected;
      for (Vertex a = 0; a < scene.num_vertices; ++a) {
        for (Vertex c = a + 1; c < scene.num_vertices; ++c) {
          if (!may_be_tested(a, c)) continue;
          if (CountPlainly(random, a, c).num_common > 0) expected.emplace(a, c);
        }
        int num_nearest = 0;
        for (const Vertex c : ranking.NearestOf(a)) {
          if (num_nearest == 3 || !restrictions.IsQuery(a)) break;
          if (!may_be_tested(a, c)) continue;
          expected.insert(MakeVertexPair(a, c));
          ++num_nearest;
        }
      }
      std::set<VertexPair> visited;
      for (const Candidate& candidate : Collect(evidence, 3, random.graph)) {
        const auto [a, c] = candidate.pair;
        EXPECT_TRUE(visited.emplace(a, c).second);
        EXPECT_EQ(candidate.cues, evidence.Of(candidate.pair, random.graph));
        const Counts counts = CountPlainly(random, a, c);
        EXPECT_EQ(candidate.cues[4], std::log1p(counts.most_shared));
        EXPECT_EQ(candidate.cues[5], std::log1p(counts.num_shared));
        EXPECT_EQ(candidate.cues[6], std::log1p(counts.num_common));
        const double least_degree =
            static_cast<double>(std::min(random.graph.Degree(a), random.graph.Degree(c)));
        EXPECT_EQ(candidate.cues[7], counts.num_common / (least_degree + 1));
        EXPECT_EQ(candidate.cues[8],
                  counts.num_failed / (counts.num_failed + 2 * counts.num_common + 1));
      }
      EXPECT_EQ(visited, expected);
    }
  }
}

TEST(PairEvidence, OfATestedPairDoesNotKnowOfTheTest) {
  const Scene scene = MakeScene(3, 7, 3, 0.5, 2);
  const VectorRanking ranking = MakeRanking(scene);
  ThreadPool threads(2);
  const RandomGraph whole = MakeRandomGraph(scene.num_vertices, 0.3, 7);
  const PairRestrictions none;
  // Also of pairs that may not be tested.
  for (const PairRestrictions& restrictions : {none, EveryThirdIsAQuery(scene.num_vertices)}) {
    PairEvidence evidence(ranking, kNoPriors, restrictions, threads);
    AddInSteps(whole, 2, &evidence);
    const std::vector<LabelledCues> described =
        evidence.WithoutThem(whole.tested, whole.graph, whole.tracks);
    ASSERT_EQ(described.size(), whole.tested.size());
    for (std::size_t i = 0; i < whole.tested.size(); ++i) {
      EXPECT_EQ(described[i].is_edge, whole.tested[i].is_edge);
      const VertexPair& pair = whole.tested[i].pair;
      const RandomGraph without = MakeRandomGraph(scene.num_vertices, 0.3, 7, {pair});
      PairEvidence evidence_without(ranking, kNoPriors, none, threads);
      AddInSteps(without, 1, &evidence_without);
      EXPECT_EQ(evidence_without.Of(pair, without.graph), described[i].cues);
    }
  }
}

TEST(EdgeModel, FindsTheCoefficientsThatMadeTheTests) {
  Random random({5});
  std::vector<LabelledCues> tested;
  for (int i = 0; i < 20000; ++i) {
    LabelledCues one;
    one.cues = {1, random.Uniform() * 4 - 2, random.Uniform() * 4 - 2};
    const double x = -0.5 + 2 * one.cues[1] - 1 * one.cues[2];
    one.is_edge = random.Uniform() < 1 / (1 + std::exp(-x));
    tested.push_back(one);
  }
  EdgeModel model;
  model.Fit(tested);
  EXPECT_NEAR(model.Coefficients()[0], -0.5, 0.1);
  EXPECT_NEAR(model.Coefficients()[1], 2, 0.1);
  EXPECT_NEAR(model.Coefficients()[2], -1, 0.1);
  EXPECT_NEAR(model.Coefficients()[3], 0, 1e-9);
  EXPECT_NEAR(model.Probability({1, 0.5, 0.5}), 0.5, 0.02);
}

TEST(EdgeModel, WorksWhereAllTestsEndAlikeOrAreApart) {
  const Cues near = {1, 1};
  const Cues far = {1, -1};
  for (const bool is_edge : {false, true}) {
    EdgeModel model;
    model.Fit(std::vector<LabelledCues>(50, {near, is_edge}));
    EXPECT_EQ(model.Probability(near) > 0.9, is_edge);
    EXPECT_EQ(model.Probability(near) < 0.1, !is_edge);
  }
  std::vector<LabelledCues> apart(50, {near, true});
  apart.resize(100, {far, false});
  EdgeModel model;
  model.Fit(apart);
  EXPECT_GT(model.Probability(near), 0.9);
  EXPECT_LT(model.Probability(far), 0.1);
  EdgeModel empty;
  empty.Fit({});
  EXPECT_EQ(empty.Probability(near), 0.5);
}

// Tests until this share of the edges is found.
std::size_t TestsForRecall(double recall, const RecordingVerifier& verifier,
                           const std::set<ImagePair>& edges) {
  std::size_t num_edges = 0;
  for (std::size_t i = 0; i < verifier.tested.size(); ++i) {
    num_edges += edges.count(verifier.tested[i]);
    if (static_cast<double>(num_edges) >= recall * static_cast<double>(edges.size())) return i + 1;
  }
  return verifier.tested.size() + 1;
}

TEST(BestFirst, FindsEdgesInFewerTestsThanTheLoop) {
  const Scene scene = MakeScene(12, 20, 4, 0.6, 3);
  const VectorRanking ranking = MakeRanking(scene);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  const std::set<ImagePair> edges = ImageEdges(scene, ids);
  RecordingVerifier verifier(edges);
  const ExplorationResult result = RunBestFirst({}, ranking, &verifier);
  RecordingVerifier loop(edges);
  ThreadPool threads(2);
  RunGraphMatch({}, ranking, ids, loop, threads, nullptr);
  for (const double recall : {0.5, 0.8, 0.9, 0.95}) {
    EXPECT_LT(TestsForRecall(recall, verifier, edges), TestsForRecall(recall, loop, edges))
        << recall;
  }
}

TEST(PairEvidence, OffersWhatIsNearByItsPriors) {
  std::vector<std::vector<ScoredVertex>> lists(6);
  const ListRanking ranking(lists);
  ThreadPool threads(2);
  const ImagePriors priors(MakeImages({"1.jpg", "2.jpg", "3.jpg", "4.jpg", "x.jpg", "y.jpg"}), {},
                           threads);
  const PairRestrictions restrictions;
  PairEvidence evidence(ranking, priors, restrictions, threads);
  MatchingGraph graph(6);
  graph.Add({{{0, 1}, false}});
  evidence.Add({{{0, 1}, false}}, graph, SharedTracks(6));
  std::set<VertexPair> offered;
  for (const Candidate& candidate : Collect(evidence, 1, graph, 1)) {
    EXPECT_TRUE(offered.insert(candidate.pair).second);
    EXPECT_EQ(candidate.cues[13], 1);
    EXPECT_EQ(candidate.cues[14], 1.0 / (candidate.pair.second - candidate.pair.first));
  }
  // (0, 1) was tested.
  EXPECT_EQ(offered, (std::set<VertexPair>{{0, 2}, {1, 2}, {2, 3}}));
  EXPECT_THAT(Collect(evidence, 1, graph), IsEmpty());
}

// Tests until 0.95 of a scene's edges are found.
std::size_t TestsWith(const ImagePriors& priors, const Scene& scene) {
  const std::set<ImagePair> edges = ImageEdges(scene, MakeIds(scene.num_vertices));
  RecordingVerifier verifier(edges);
  RunBestFirst({}, MakeRanking(scene), &verifier, 2, priors);
  return TestsForRecall(0.95, verifier, edges);
}

// What right ones save and wrong ones cost; to find out that they are wrong takes about a batch.
template <typename Value, typename ToPriors>
void ExpectRightOnesToHelp(std::vector<Value> values, const Scene& scene,
                           const ToPriors& to_priors) {
  const std::size_t without = TestsWith(kNoPriors, scene);
  EXPECT_LT(TestsWith(to_priors(values), scene), without * 9 / 10);
  Random random({5});
  for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[random.Index(i)]);
  EXPECT_LT(TestsWith(to_priors(values), scene), without * 11 / 10);
}

TEST(BestFirst, RightPositionsHelpAndWrongOnesCostLittle) {
  const Scene scene = MakeScene(12, 20, 4, 0.6, 3);
  // Walks far apart, a metre from photo to photo, measured to 10 m.
  std::vector<PositionPrior> positions(scene.num_vertices);
  Random random({4});
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double x = static_cast<double>(i % 20) + 10 * random.Uniform();
    const double y = 10 * random.Uniform();
    const double place = static_cast<double>(i / 20) / 100;
    positions[i].position = {50 + place + x / 111000, 8 + y / 72000, 0};
  }
  ExpectRightOnesToHelp(positions, scene, [](const std::vector<PositionPrior>& of_vertices) {
    std::map<ImageId, PositionPrior> by_id;
    for (const PositionPrior& position : of_vertices) {
      by_id[static_cast<ImageId>(by_id.size() + 1)] = position;
    }
    ThreadPool threads(2);
    return ImagePriors(MakeImages(std::vector<std::string>(by_id.size(), "x.jpg")), by_id, threads);
  });
}

TEST(BestFirst, RightSequencesHelpAndWrongOnesCostLittle) {
  // Photos hardly look like their neighbours.
  const Scene scene = MakeScene(6, 40, 3, 2.5, 12);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < scene.num_vertices; ++i) {
    names.push_back("walk " + std::to_string(i / 40) + "/" + std::to_string(i) + ".jpg");
  }
  ExpectRightOnesToHelp(names, scene, [](const std::vector<std::string>& of_vertices) {
    ThreadPool threads(2);
    return ImagePriors(MakeImages(of_vertices), {}, threads);
  });
}

TEST(BestFirst, LoopsOfSequencesClose) {
  // Every walk is gone twice: half of the edges are far apart in its sequence.
  const Scene scene = MakeScene(6, 40, 4, 0.6, 12);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < scene.num_vertices; ++i) {
    names.push_back(std::to_string(i / 40) + "/" + std::to_string(i % 40 / 2 + i % 2 * 20));
  }
  ThreadPool threads(2);
  const ImagePriors priors(MakeImages(names), {}, threads);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  RecordingVerifier verifier(ImageEdges(scene, ids));
  RunBestFirst({}, MakeRanking(scene), &verifier, 2, priors);
  const std::set<ImagePair> tested(verifier.tested.begin(), verifier.tested.end());
  std::size_t num_far = 0;
  std::size_t num_found = 0;
  for (const auto& [a, b] : scene.edges) {
    if (a % 2 == b % 2) continue;
    ++num_far;
    num_found += tested.count(ImagePair(ids[a], ids[b]));
  }
  EXPECT_GE(num_found * 100, num_far * 97);
}

TEST(BestFirst, TestsTheSameOnAnyNumberOfThreads) {
  const Scene scene = MakeScene(8, 20, 5, 0.8, 4);
  const VectorRanking ranking = MakeRanking(scene);
  std::vector<std::vector<std::vector<ImagePair>>> batches;
  for (const int num_threads : {1, 2, 3}) {
    RecordingVerifier verifier(ImageEdges(scene, MakeIds(scene.num_vertices)));
    RunBestFirst({}, ranking, &verifier, num_threads);
    batches.push_back(verifier.batches);
  }
  EXPECT_GT(batches[0].size(), 3U);
  EXPECT_EQ(batches[0], batches[1]);
  EXPECT_EQ(batches[0], batches[2]);
}

TEST(BestFirst, GoesOnAfterAnInterruptionAsIfThereHadBeenNone) {
  const Scene scene = MakeScene(8, 16, 4, 0.7, 5);
  const VectorRanking ranking = MakeRanking(scene);
  const std::set<ImagePair> edges = ImageEdges(scene, MakeIds(scene.num_vertices));
  RecordingVerifier whole(edges);
  RunBestFirst({}, ranking, &whole);
  const std::set<ImagePair> expected(whole.tested.begin(), whole.tested.end());
  for (std::size_t stop_after = 0; stop_after < whole.tested.size(); stop_after += 97) {
    RecordingVerifier first(edges);
    first.stop_after = stop_after;
    RunBestFirst({}, ranking, &first);
    RecordingVerifier second(edges);
    second.known.insert(first.tested.begin(), first.tested.end());
    RunBestFirst({}, ranking, &second);
    std::set<ImagePair> tested = second.known;
    tested.insert(second.tested.begin(), second.tested.end());
    EXPECT_EQ(tested, expected) << "after " << stop_after;
  }
}

TEST(BestFirst, LearnsFromWhatOthersHadTested) {
  const Scene scene = MakeScene(8, 16, 4, 0.7, 6);
  const VectorRanking ranking = MakeRanking(scene);
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  const std::set<ImagePair> edges = ImageEdges(scene, ids);
  RecordingVerifier verifier(edges);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    for (std::size_t j = i + 1; j < std::min(i + 9, ids.size()); ++j) {
      if (i % 16 < 12) verifier.known.emplace(ids[i], ids[j]);
    }
  }
  const ExplorationResult result = RunBestFirst({}, ranking, &verifier);
  EXPECT_EQ(result.num_seed_pairs, verifier.known.size());
  for (const ImagePair& pair : verifier.tested) EXPECT_EQ(verifier.known.count(pair), 0U);
  EXPECT_GE(static_cast<double>(result.graph.NumEdges()),
            0.98 * static_cast<double>(scene.edges.size()));
  ASSERT_FALSE(verifier.batches.empty());
  // It knows from the beginning what is likely.
  EXPECT_EQ(result.stages[LoopStage::kSampling].num_tested, 0U);
}

TEST(BestFirst, TestsWhatMayBeTestedAlone) {
  const Scene scene = MakeScene(4, 12, 3, 0.6, 7);
  const VectorRanking ranking = MakeRanking(scene);
  BestFirstOptions options;
  options.restrictions.queries.resize(scene.num_vertices);
  for (const Vertex vertex : {0, 5, 13, 40}) options.restrictions.queries[vertex] = true;
  options.restrictions.frames.resize(scene.num_vertices);
  options.restrictions.frames[0] = options.restrictions.frames[1] = 9;
  const std::vector<ImageId> ids = MakeIds(scene.num_vertices);
  RecordingVerifier verifier(ImageEdges(scene, ids));
  RunBestFirst(options, ranking, &verifier);
  EXPECT_FALSE(verifier.tested.empty());
  const std::set<ImageId> queries = {ids[0], ids[5], ids[13], ids[40]};
  for (const ImagePair& pair : verifier.tested) {
    EXPECT_TRUE(queries.count(pair.id1) > 0 || queries.count(pair.id2) > 0);
    EXPECT_FALSE(pair == ImagePair(ids[0], ids[1]));
  }
}

TEST(BestFirst, EndsWhereThereIsNothingToFind) {
  for (const std::size_t num_vertices : {0, 1, 2, 30}) {
    std::vector<std::vector<ScoredVertex>> lists(num_vertices);
    for (Vertex a = 0; a < num_vertices; ++a) {
      for (Vertex b = 0; b < num_vertices; ++b) {
        if (a != b) lists[a].push_back({b, 1.0F / static_cast<float>(1 + b)});
      }
    }
    const ListRanking ranking(lists);
    RecordingVerifier verifier({});
    const ExplorationResult result = RunBestFirst({}, ranking, &verifier);
    EXPECT_TRUE(result.finished);
    EXPECT_EQ(verifier.tested.empty(), num_vertices < 2);
  }
  const ListRanking unranked(std::vector<std::vector<ScoredVertex>>(5));
  RecordingVerifier verifier({});
  EXPECT_TRUE(RunBestFirst({}, unranked, &verifier).finished);
  EXPECT_THAT(verifier.tested, IsEmpty());
}

// All like each other in the order of their numbers, and the last one, which nobody lists.
ListRanking MakeLonely(std::size_t num_vertices, std::size_t place_of_partner) {
  std::vector<std::vector<ScoredVertex>> lists(num_vertices);
  const auto lonely = static_cast<Vertex>(num_vertices - 1);
  for (Vertex a = 0; a < lonely; ++a) {
    for (Vertex b = 0; b < lonely; ++b) {
      if (a != b) lists[a].push_back({b, -std::abs(static_cast<float>(a) - static_cast<float>(b))});
    }
    // Vertex 0 is at the place.
    const std::size_t place = a == 0 ? place_of_partner : a <= place_of_partner ? a - 1 : a;
    lists[lonely].push_back({a, -static_cast<float>(place)});
  }
  return ListRanking(lists);
}

TEST(BestFirst, ImagesWithoutAnEdgeDrawOnForAWhile) {
  constexpr std::size_t kNum = 100;
  const std::vector<ImageId> ids = MakeIds(kNum);
  const ImagePair partner(ids[0], ids[kNum - 1]);
  std::set<ImagePair> edges = {partner};
  for (std::size_t i = 0; i + 1 < kNum; ++i) {
    for (std::size_t j = i + 1; j < std::min(i + 4, kNum - 1); ++j) edges.emplace(ids[i], ids[j]);
  }
  const auto num_of_last = [&](const RecordingVerifier& verifier) {
    return std::count_if(verifier.tested.begin(), verifier.tested.end(),
                         [&](const ImagePair& pair) { return pair.id2 == ids.back(); });
  };
  RecordingVerifier near(edges);
  RunBestFirst({}, MakeLonely(kNum, 20), &near);
  EXPECT_EQ(std::count(near.tested.begin(), near.tested.end(), partner), 1);
  RecordingVerifier far(edges);
  RunBestFirst({}, MakeLonely(kNum, 90), &far);
  EXPECT_EQ(std::count(far.tested.begin(), far.tested.end(), partner), 0);
  EXPECT_GE(num_of_last(far), 30);
  EXPECT_LT(num_of_last(far), 50);
}

TEST(BestFirst, UnlistedImagesAreNotTheNearest) {
  std::vector<std::vector<ScoredVertex>> lists(4);
  lists[0] = {{1, 3}, {2, 2}};
  const ListRanking ranking(lists);
  const PairRestrictions restrictions;
  ThreadPool threads(1);
  const PairEvidence evidence(ranking, kNoPriors, restrictions, threads);
  const MatchingGraph graph(4);
  const std::vector<Candidate> candidates = Collect(evidence, 5, graph);
  ASSERT_EQ(candidates.size(), 2U);
  EXPECT_EQ(candidates[0].pair, VertexPair(0, 1));
  EXPECT_EQ(candidates[0].cues[1], 1);  // Scores are no distances.
  EXPECT_EQ(candidates[0].cues[2], 0);
  EXPECT_EQ(candidates[0].cues[3], std::log1p(4));
}

TEST(BestFirst, GoesOnAfterFailedPairs) {
  const Scene scene = MakeScene(4, 12, 3, 0.6, 8);
  const VectorRanking ranking = MakeRanking(scene);
  const std::set<ImagePair> edges = ImageEdges(scene, MakeIds(scene.num_vertices));
  RecordingVerifier verifier(edges);
  verifier.failing = {*edges.begin(), *edges.rbegin()};
  const ExplorationResult result = RunBestFirst({}, ranking, &verifier);
  EXPECT_TRUE(result.finished);
  EXPECT_THAT(result.failed_pairs, ::testing::IsSubsetOf(verifier.failing));
  EXPECT_GT(result.graph.NumEdges(), edges.size() / 2);
}

TEST(BestFirst, AModelNeedsFewerTestsAndHangsTogetherAsWell) {
  const Scene scene = MakeScene(4, 60, 15, 0.4, 9);
  const VectorRanking ranking = MakeRanking(scene);
  const std::set<ImagePair> edges = ImageEdges(scene, MakeIds(scene.num_vertices));
  RecordingVerifier all(edges);
  const ExplorationResult whole = RunBestFirst({}, ranking, &all);
  BestFirstOptions options;
  options.goal = BestFirstOptions::Goal::kModel;
  RecordingVerifier some(edges);
  const ExplorationResult model = RunBestFirst(options, ranking, &some);
  EXPECT_LT(some.tested.size(), all.tested.size() * 85 / 100);
  EXPECT_EQ(model.num_components, whole.num_components);
  for (Vertex a = 0; a < scene.num_vertices; ++a) {
    EXPECT_GE(model.graph.Degree(a), std::min<std::size_t>(whole.graph.Degree(a), 10)) << a;
  }
}

TEST(BestFirst, RefusesAProbabilityThatIsNone) {
  for (const double probability : {0.0, -0.1, 1.0, std::nan("")}) {
    BestFirstOptions options;
    options.min_edge_probability = probability;
    EXPECT_THROW(options.Check(), OptionsError) << probability;
  }
  BestFirstOptions options;
  const std::string key = options.Key();
  options.min_edge_probability = 0.006;
  EXPECT_NE(options.Key(), key);
}

}  // namespace
}  // namespace colmap_graphmatch
