"""report_page.py MAKE_HTML_REPORT WORK_DIR: opens pages of made-up reports in Chromium and uses them."""

import itertools
import json
import pathlib
import re
import struct
import subprocess
import sys
import unittest
import zlib

from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.ui import WebDriverWait

MAKE_HTML_REPORT, WORK = sys.argv[1], pathlib.Path(sys.argv[2])

HOSTILE = ['</script><img src=x onerror="hacked=1">.jpg', '<!--<script>hacked=1</script>.jpg',
           '"><svg onload=hacked=1>\'&lt;.jpg', '{{page.js}}', '__proto__', '\\"\u2028日本 ü.jpg',
           'a' * 200 + '.jpg']


def stage(tested=0, edges=0, known=0, known_edges=0, failed=0, seconds=0.0):
    return dict(tested=tested, edges=edges, failed=failed, known=known, known_edges=known_edges, seconds=seconds)


def make_report(names, components, edges, nonedges=(), without_edge=(), **members):
    """A report in which this run has tested all pairs, by sampling and propagation in turns."""
    edges = sorted([min(a, b), max(a, b), inliers] for a, b, inliers in edges)
    tested = len(edges) + len(nonedges)
    sampled, sampled_edges = tested // 2, len(edges) // 2
    discovery = []
    if tested:
        discovery = [dict(stage='sampling', iteration=0, tests=1, edges=1 if edges else 0, seconds=61.0),
                     dict(stage='sampling', iteration=0, tests=sampled, edges=sampled_edges, seconds=75.0),
                     dict(stage='propagation', iteration=0, tests=tested, edges=len(edges), seconds=200.5)]
    without_features = sum(1 for entry in without_edge if entry['features'] == 0)
    report = dict(
        schema='graphmatch-report', version=1, program='graphmatch_matcher 0.1.0', replay=False, finished=True,
        stopped_by=None, strategy='graphmatch', descriptor='fisher', min_num_inliers=15, threads=2,
        peak_memory_mb=1234.5,
        images=dict(total=len(names), without_features=without_features, isolated=len(without_edge)),
        graph=dict(tested=tested, edges=len(edges), components=len(components),
                   largest_component=max(map(len, components), default=0)),
        seconds=dict(mixture=50.0, vectors=10.0, ranking=0.5, matching=140.0, total=201.0),
        stages=dict(sampling=stage(sampled, sampled_edges, seconds=40.0),
                    propagation=stage(tested - sampled, len(edges) - sampled_edges, seconds=100.0),
                    listed=stage(), retrieval=stage(), expansion=stage()),
        iterations=[dict(iteration=0, sampling=stage(sampled, sampled_edges, seconds=40.0),
                         propagation=stage(tested - sampled, len(edges) - sampled_edges, seconds=100.0))],
        image_names=names, image_ids=[2 * i + 1 for i in range(len(names))],
        num_features=[1000 + i for i in range(len(names))], connected_components=components, edge_list=edges,
        nonedge_list=[image for pair in nonedges for image in pair], nonedges_left_out=0, discovery=discovery,
        articulation_points=[], num_articulation_points=0, bridges=[], num_bridges=0, weak_links=[], images_without_edge=list(without_edge))
    for entry in without_edge:
        report['num_features'][entry['image']] = entry['features']
    report.update(members)
    return report


def rich_report():
    """Two groups of 15 images joined by one edge, a star of 5, a pair, 130 pairs more, and three images alone."""
    first, second, star = range(15), range(15, 30), range(30, 35)
    edges = [(a, b, 20 + a * b % 300) for group in (first, second) for a, b in itertools.combinations(group, 2)]
    edges += [(14, 15, 17)] + [(30, b, 1500) for b in star if b != 30]
    pairs = [[i, i + 1] for i in range(35, 297, 2)]
    edges += [(a, b, 15) for a, b in pairs]
    alone = [dict(image=297, features=1234, candidates=[
        dict(image=0, distance=0.8125, inliers=14, matches=None), dict(image=HOSTILE_AT, distance=None, inliers=0)]),
        dict(image=298, features=0, candidates=[]), dict(image=299, features=150, candidates=[])]
    names = [f'place/photo {i:03d}.jpg' for i in range(300)]
    names[HOSTILE_AT:HOSTILE_AT + len(HOSTILE)] = HOSTILE
    report = make_report(
        names, [list(range(30)), list(star), *pairs], edges, [(0, 20), (0, 297), (1, 297), (2, 40)], alone,
        bridges=[dict(images=[14, 15], inliers=17, sides=[15, 15])], num_bridges=136,
        articulation_points=[dict(image=14, parts=[15, 14]), dict(image=15, parts=[15, 14])],
        num_articulation_points=3,
        weak_links=[dict(groups=[15, 15], edges=[[14, 15, 17]])], finished=False, stopped_by='max_pairs')
    report['stages']['listed'] = stage(known=7, known_edges=5, failed=2)
    report['graph']['tested'] += 1000
    return report


HOSTILE_AT = 3


def write_png(path, width, height):
    """A grey picture."""
    def chunk(kind, data):
        return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
    rows = b''.join(b'\0' + bytes(x % 256 for x in range(width)) for _ in range(height))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', width, height, 8, 0, 0, 0, 0)) +
                     chunk(b'IDAT', zlib.compress(rows)) + chunk(b'IEND', b''))


class PageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        options = webdriver.ChromeOptions()
        for argument in ('--headless=new', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
                         '--disable-background-networking', '--disable-component-update', '--disable-sync',
                         '--disable-dev-shm-usage', '--user-data-dir=' + str(WORK / 'profile')):
            options.add_argument(argument)
        options.set_capability('goog:loggingPrefs', {'browser': 'ALL'})
        cls.driver = webdriver.Chrome(service=Service('/usr/bin/chromedriver'), options=options)

    @classmethod
    def tearDownClass(cls):
        cls.driver.quit()

    def tearDown(self):
        self.assertEqual(self.driver.get_log('browser'), [])
        self.assertFalse(self.script('return "hacked" in window'))

    def open(self, report, width=1280, dark=False, image_path=None):
        json_path, page = WORK / 'report.json', WORK / 'report.html'
        json_path.write_text(json.dumps(report, ensure_ascii=False, indent=1), encoding='utf-8')
        subprocess.run([MAKE_HTML_REPORT, json_path, page, *([image_path] if image_path else [])], check=True)
        command = self.driver.execute_cdp_cmd
        command('Emulation.setDeviceMetricsOverride',
                dict(width=width, height=900, deviceScaleFactor=1, mobile=False))
        command('Emulation.setEmulatedMedia', dict(features=[
            dict(name='prefers-color-scheme', value='dark' if dark else 'light'),
            dict(name='prefers-reduced-motion', value='reduce')]))
        self.driver.get(page.as_uri())
        self.wait('document.documentElement.dataset.ready === "true"')
        self.report = report

    def script(self, code, *arguments):
        return self.driver.execute_script(code, *arguments)

    def wait(self, condition):
        WebDriverWait(self.driver, 100, 0.05).until(lambda _: self.script(f'return {condition}'), condition)

    def text(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector).get_attribute('textContent')

    def cells(self, selector):
        """The text of a table's body."""
        return self.script('''return [...document.querySelector(arguments[0]).tBodies[0].rows].map(
            (row) => [...row.cells].map((cell) => cell.textContent))''', selector)

    def visible(self, element_id):
        return self.driver.find_element(By.ID, element_id).is_displayed()

    def press(self, *keys):
        ActionChains(self.driver).send_keys(*keys).perform()

    def open_bubble(self, number):
        bubble = self.script('''return [...document.querySelectorAll('.bubble')].find(
            (bubble) => bubble.getAttribute('aria-label').startsWith(`Component ${arguments[0]}:`))''', number)
        ActionChains(self.driver).move_to_element(bubble).click().perform()
        self.wait('performance.getEntriesByName("layout settled").length > 0')

    def key_figure(self, name):
        return self.text(f'#key-{name} span')

    def test_headline(self):
        self.open(rich_report())
        report = self.report
        tested = sum(s['tested'] for s in report['stages'].values())
        edges = report['graph']['edges']
        self.assertEqual(self.text('#headline'), f'{edges} edges among 300 images: 133 components, the largest of 30 '
                         'images')
        self.assertIn('--GraphMatching.max_pairs', self.text('#outcome'))
        self.assertEqual({name: self.key_figure(name) for name in
                          ('images', 'edges', 'components', 'largest', 'isolated', 'tested', 'efficiency', 'time')},
                         dict(images='300', edges=str(edges), components='133', largest='30', isolated='3',
                              tested=f'{tested + 1000:,}', efficiency=f'{100 * edges / tested:.1f} %',
                              time='3 min 21 s'))
        self.assertIn('of 44,551 possible', self.text('#key-tested'))
        self.assertIn(f'{tested} by this run', self.text('#key-tested'))
        self.assertIn('1 without features', self.text('#key-images'))

    def test_stages(self):
        self.open(rich_report())
        stages = self.report['stages']
        rows = {row[0]: row[1:] for row in self.cells('#stages')}
        self.assertEqual(list(rows), ['Sampling', 'Propagation', 'Listed', 'All'])
        for name in ('sampling', 'propagation', 'listed'):
            s = stages[name]
            self.assertEqual(rows[name.capitalize()][:2], [f'{s["tested"]:,}', f'{s["edges"]:,}'])
            self.assertEqual(rows[name.capitalize()][4:], [str(s['known']), str(s['known_edges']), str(s['failed'])])
        self.assertEqual(rows['Propagation'][2:4],
                         [f'{100 * stages["propagation"]["edges"] / stages["propagation"]["tested"]:.1f} %',
                          '1 min 40 s'])
        self.assertEqual(rows['All'][0], f'{sum(s["tested"] for s in stages.values()):,}')
        self.assertEqual(rows['All'][1], f'{self.report["graph"]["edges"]:,}')
        self.assertEqual(len(self.cells('#iterations')), 2)

    def test_a_stage_that_the_page_does_not_know(self):
        report = rich_report()
        report['stages']['divination'] = stage(tested=1234, edges=1, seconds=50.0)
        self.open(report)
        rows = {row[0]: row[1:] for row in self.cells('#stages')}
        self.assertEqual(list(rows), ['Sampling', 'Propagation', 'Listed', 'Divination', 'All'])
        self.assertEqual(rows['Divination'][0], '1,234')
        self.assertEqual(rows['All'][0], f'{sum(s["tested"] for s in report["stages"].values()):,}')
        self.assertIn('Divination', self.text('#time-legend'))

    def test_discovery(self):
        self.open(rich_report())
        curves = 'return document.querySelectorAll("#discovery-chart .curve").length'
        self.assertEqual(self.script(curves), 2)
        self.assertIn('pairs tested', self.text('#discovery-chart'))
        self.driver.find_element(By.ID, 'over-time').click()
        self.assertEqual(self.script(curves), 3)
        self.assertIn('(minutes)', self.text('#discovery-chart'))
        chart = self.driver.find_element(By.CSS_SELECTOR, '#discovery-chart svg')
        ActionChains(self.driver).move_to_element_with_offset(chart, chart.size['width'] // 2 - 20, 0).perform()
        last = self.report['discovery'][-1]
        self.assertIn(f'After {last["tests"]} pairs and 3 min 21 s: {last["edges"]} edges',
                      self.text('#discovery-readout'))

    def test_lists(self):
        self.open(rich_report())
        rows = self.cells('#components-table table')
        self.assertEqual(len(rows), 100)
        self.assertEqual(rows[0][:4], ['1', '30', '211', '14.1'])
        self.assertEqual(rows[1][:5], ['2', '5', '4', '1.6', self.report['image_names'][30]])
        self.driver.find_element(By.CSS_SELECTOR, '#components-table .more').click()
        self.assertEqual(len(self.cells('#components-table table')), 133)

        names = self.report['image_names']
        self.assertEqual(self.cells('#bridges table'), [['15 | 15', names[14], names[15], '17', 'Show']])
        self.assertIn('135 bridges', self.text('#bridges'))
        self.assertEqual([row[:3] for row in self.cells('#articulation-points table')],
                         [[names[14], '15 | 14', '15'], [names[15], '15 | 14', '15']])
        self.assertIn('1 articulation point on', self.text('#articulation-points'))
        self.assertEqual(len(self.cells('#weak-links table')), 1)

        cards = self.driver.find_elements(By.CSS_SELECTOR, '#without-edge-list article')
        self.assertEqual(len(cards), 3)
        self.assertIn('14 inliers of the 15', cards[0].text)
        self.assertEqual(self.cells('#without-edge-list table'),
                         [[names[0], '0.81', '14'], [names[HOSTILE_AT], '–', '0']])
        self.assertIn('It has no features', cards[1].text)
        self.assertIn('before the run was stopped', cards[2].text)
        self.assertIn('few features (150)', cards[2].text)

    def test_degrees(self):
        self.open(rich_report())
        degrees = [0] * 300
        for a, b, _ in self.report['edge_list']:
            degrees[a] += 1
            degrees[b] += 1
        titles = self.script('''return [...document.querySelectorAll('#degree-chart rect title')].map(
            (title) => title.textContent)''')
        shown = dict(reversed(re.match(r'(\d+) images? with (\d+)', title).groups()) for title in titles)
        self.assertEqual({int(k): int(v) for k, v in shown.items()},
                         {d: degrees.count(d) for d in range(max(degrees) + 1)})

    def test_adjacency(self):
        """In the middle of every cell of the picture is the colour of its pair."""
        self.open(rich_report())
        counts = self.script('''
            const picture = document.getElementById('adjacency-picture');
            const {data} = picture.getContext('2d').getImageData(0, 0, picture.width, picture.height);
            const cell = picture.width / 300, counts = {};
            for (let y = 0; y < 300; ++y) {
              for (let x = 0; x < 300; ++x) {
                const at = 4 * (Math.floor((y + 0.5) * cell) * picture.width + Math.floor((x + 0.5) * cell));
                const rgb = data.slice(at, at + 3).join();
                counts[rgb] = (counts[rgb] || 0) + 1;
              }
            }
            const style = getComputedStyle(document.documentElement);
            const rgb = (name) => {
              const {r, g, b} = d3.color(style.getPropertyValue(name).trim());
              return [r, g, b].join();
            };
            return {edges: counts[rgb('--edge')], tested: counts[rgb('--tested')]};''')
        self.assertEqual(counts, dict(edges=2 * self.report['graph']['edges'], tested=2 * 4))

    def test_graph(self):
        self.open(rich_report())
        bubbles = self.driver.find_elements(By.CSS_SELECTOR, '.bubble')
        self.assertEqual(len(bubbles), 134)
        self.assertEqual(self.script('return document.querySelector(".bubble.alone").ariaLabel'),
                         '3 images without an edge')
        self.open_bubble(1)
        self.assertTrue(self.visible('inside'))
        self.assertFalse(self.visible('overview'))
        self.assertEqual(self.text('#graph-title'), 'Component 1: 30 images, 211 edges')
        self.assertIn('bridge', self.text('#graph-legend'))
        self.wait('''(function () {
            const canvas = document.getElementById('inside');
            const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
            return data.some((value) => value > 0);
          })()''')
        self.press('+', '-', Keys.ARROW_LEFT)
        self.driver.find_element(By.ID, 'zoom-fit').click()

        # Somewhere the mouse finds an image, and a click opens it.
        canvas = self.driver.find_element(By.ID, 'inside')
        self.script('arguments[0].scrollIntoView({block: "center"})', canvas)
        hit = self.script('''
            const canvas = arguments[0], box = canvas.getBoundingClientRect();
            for (let y = 0; y < box.height; y += 5) {
              for (let x = 0; x < box.width; x += 5) {
                canvas.dispatchEvent(new MouseEvent('mousemove', {clientX: box.left + x, clientY: box.top + y}));
                if (!document.getElementById('tooltip').hidden) return [x - box.width / 2, y - box.height / 2];
              }
            }''', canvas)
        name = self.text('#tooltip p')
        self.assertIn(name, self.report['image_names'][:30])
        x, y = int(hit[0]) + 1, int(hit[1]) + 1
        ActionChains(self.driver).move_to_element_with_offset(canvas, x, y).click().perform()
        self.assertTrue(self.visible('panel'))
        self.assertIn(self.text('#panel-name'), self.report['image_names'][:30])
        self.press(Keys.ESCAPE)
        self.assertFalse(self.visible('panel'))
        self.assertTrue(self.visible('inside'))
        self.press(Keys.ESCAPE)
        self.assertFalse(self.visible('inside'))
        self.assertTrue(self.visible('overview'))

        # By the keyboard, and back by the button.
        self.script('document.querySelector(".bubble").focus()')
        self.press(Keys.ENTER)
        self.assertTrue(self.visible('inside'))
        self.driver.find_element(By.ID, 'back').click()
        self.assertTrue(self.visible('overview'))

    def test_search(self):
        self.open(rich_report())
        search = self.driver.find_element(By.ID, 'search')
        search.send_keys('PHOTO 01')
        hits = self.driver.find_elements(By.CSS_SELECTOR, '#hits button')
        self.assertEqual(len(hits), sum('photo 01' in name for name in self.report['image_names']))
        search.clear()
        search.send_keys('photo 030', Keys.ENTER)
        self.assertTrue(self.visible('panel'))
        self.assertEqual(self.text('#panel-name'), 'place/photo 030.jpg')
        self.assertEqual(self.cells('#panel table'), [[f'place/photo 0{i}.jpg', '1,500'] for i in range(31, 35)])
        self.assertIn('1030', self.text('#panel dl').replace(',', ''))
        self.driver.find_element(By.CSS_SELECTOR, '#panel p button').click()
        self.assertEqual(self.text('#graph-title'), 'Component 2: 5 images, 4 edges')
        search.clear()
        search.send_keys('no such image')
        self.assertIn('No image', self.text('#hits'))
        self.press(Keys.ESCAPE)
        self.assertFalse(self.visible('hits'))

    def test_hostile_names(self):
        self.open(rich_report())
        tags = 'return document.querySelectorAll("main img, main script, svg[onload]").length'
        self.assertEqual(self.script(tags), 0)
        for name in HOSTILE:
            search = self.driver.find_element(By.ID, 'search')
            search.clear()
            search.send_keys(name.replace('\u2028', '')[:12] if '\u2028' not in name else '日本', Keys.ENTER)
            self.assertIn(self.text('#panel-name'), HOSTILE)
            self.press(Keys.ESCAPE)
        self.open_bubble(1)
        self.assertEqual(self.script(tags), 0)

    def test_pairs_that_are_left_out(self):
        self.open(rich_report())
        self.assertIn('tested, no edgenot tested', self.text('#adjacency-legend'))
        self.open(dict(rich_report(), nonedges_left_out=1996))
        self.assertIn('tested, no edge (of 2,000 such pairs 4 are drawn)', self.text('#adjacency-legend'))

    def test_thumbnails(self):
        report = rich_report()
        images = WORK / 'images'
        for i in (0, 1, 14, 30, 297):
            write_png(images / report['image_names'][i], 300, 200)
        self.open(report, image_path=images)
        self.script('document.querySelectorAll("img").forEach((image) => { image.loading = "eager"; })')
        self.wait('[...document.querySelectorAll("img")].every((image) => image.complete)')
        widths = self.script('return [...document.querySelectorAll("main img")].map((image) => image.naturalWidth)')
        # Two best connected images, an end of the bridge and of the weak link, an articulation point, one image alone
        # and its candidate.
        self.assertEqual(widths, [128] * 7)
        self.assertEqual(self.script('return document.querySelectorAll(".bubble image").length'), 2)
        self.open_bubble(1)

    def test_widths_and_colours(self):
        grounds = {}
        for width, dark in itertools.product((1280, 400), (False, True)):
            self.open(rich_report(), width, dark)
            fits = 'return document.scrollingElement.scrollWidth <= innerWidth'
            self.assertTrue(self.script(fits), f'{width} {dark}')
            grounds[dark] = self.script('return getComputedStyle(document.body).backgroundColor')
            self.open_bubble(1)
            search = self.driver.find_element(By.ID, 'search')
            search.send_keys('aaaaaaaa', Keys.ENTER)
            self.assertTrue(self.visible('panel'))
            self.assertTrue(self.script(fits), f'{width} {dark}, with a panel')
        self.assertNotEqual(grounds[False], grounds[True])

    def test_resized(self):
        self.open(rich_report())
        self.open_bubble(1)
        self.driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride',
                                    dict(width=500, height=900, deviceScaleFactor=2, mobile=False))
        self.wait('document.querySelector("#degree-chart svg").viewBox.baseVal.width < 500')
        self.assertTrue(self.script('return document.scrollingElement.scrollWidth <= innerWidth'))

    def test_no_edges(self):
        alone = [dict(image=i, features=100 * i, candidates=[]) for i in range(4)]
        self.open(make_report(list('abcd'), [], [], [], alone))
        self.assertEqual(self.text('#headline'), 'No edges among 4 images')
        self.assertEqual(self.key_figure('efficiency'), '–')
        self.assertEqual(self.key_figure('isolated'), '4')
        self.assertIn('tested no pair', self.text('#discovery-chart'))
        self.assertIn('no component', self.text('#components-table'))
        self.assertEqual(len(self.driver.find_elements(By.CSS_SELECTOR, '#without-edge-list article')), 4)
        self.assertEqual(self.text('#bridges'), 'None.')

    def test_no_images_left_alone(self):
        edges = [(0, 1, 15), (1, 2, 400)]
        self.open(make_report(['a', 'b', 'c'], [[0, 1, 2]], edges, [(0, 2)], finished=False, stopped_by='signal'))
        self.assertEqual(self.text('#headline'), '2 edges among 3 images: all in one component')
        self.assertIn('signal', self.text('#outcome'))
        self.assertIn('None', self.text('#without-edge-list'))
        self.open_bubble(1)
        self.press(Keys.ESCAPE)
        self.assertTrue(self.visible('overview'))

    def test_two_images_of_a_replay(self):
        report = make_report(['a', 'b'], [[0, 1]], [(0, 1, 15)], replay=True, peak_memory_mb=None)
        report['seconds']['modelled'] = 3600.0
        self.open(report)
        self.assertEqual(self.key_figure('time'), '1 h 3 min')
        self.assertIn('replay', self.text('#outcome'))
        self.open_bubble(1)

    def test_more_than_a_thousand_images(self):
        """Beyond 1,000 images the adjacency is drawn in bins, beyond 300 components the smallest are counted only."""
        groups = [list(range(1200))] + [[i, i + 1] for i in range(1200, 2000, 2)]
        edges = [(i, i + d, 15 + (i * d) % 99) for i in range(1190) for d in range(1, 10)]
        edges += [(i, i + 1, 15) for i in range(1190, 1199)] + [(a, b, 15) for a, b in groups[1:]]
        self.open(make_report([f'{i}.jpg' for i in range(2000)], groups, edges))
        self.assertIn('101 smaller components of 2 images and less (202 images in all)', self.text('#graph-status'))
        self.assertIn('2.0 × 2.0', self.text('#adjacency-readout'))
        self.open_bubble(1)
        self.assertEqual(self.text('#graph-title'), f'Component 1: 1,200 images, {len(edges) - 400:,} edges')


if __name__ == '__main__':
    unittest.main(argv=sys.argv[:1], verbosity=2)
